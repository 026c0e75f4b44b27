"""Renders walkers in Gymnasium's render modes."""

from __future__ import annotations

from typing import Any, Callable, Mapping, Optional, Sequence, Tuple, Union

import gymnasium
import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.registration import NAMESPACE
from walker_sim.window import Window

Picture = Union[NDArray[Any], Tuple[NDArray[np.uint8], NDArray[np.float32]]]
"""`WalkerEnv.render` describes the forms of a picture."""

Draw = Callable[["Pictures", Optional[NDArray[np.uint8]], Optional[NDArray[np.float32]]], None]
"""Draws a walker's present state into arrays of colours and depths [m]; None: not wanted."""

# Attributes of MuJoCo's mjvCamera that describe a free camera. The ignored ones are for other kinds
# of camera: Gymnasium accepts them, but renders with its free camera.
_FREE_CAMERA = ("distance", "lookat", "elevation", "azimuth")
_IGNORED = ("type", "fixedcamid", "trackbodyid")

ALL_MODES = ("human", "rgb_array", "depth_array", "rgbd_tuple")


def metadata_of(specification: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the ``metadata`` of Gymnasium's environment."""
    return {
        "render_modes": _core.registration_of(specification["id"])["render_modes"],
        "render_fps": round(1 / specification["dt"]),
    }


def camera_keywords_of(env_id: str) -> set[str]:
    """Returns the names of the camera's keywords; ValueError if the id is unknown."""
    names = {known["name"] for known in _core.camera_parameters_of(env_id)} - {*_FREE_CAMERA}
    if _core.registration_of(env_id)["takes_default_camera_config"]:
        names.add("default_camera_config")
    return names


def split_keywords(
    env_id: str, keywords: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Splits keywords into the environment's and its camera's; ValueError if the id is unknown."""
    names = camera_keywords_of(env_id)
    camera = {name: value for name, value in keywords.items() if name in names}
    return {name: keywords[name] for name in keywords if name not in camera}, camera


def camera_parameters_of(
    env_id: str, render_mode: str | None, keywords: Mapping[str, Any]
) -> dict[str, Any]:
    """Returns all parameters of the core's camera, given the camera's keywords.

    The default is Gymnasium's free camera, which does not move; a window's default camera follows
    the walker. Raises ValueError for two cameras or an unknown attribute of the free camera,
    TypeError if ``default_camera_config`` is not a mapping.
    """
    parameters = {known["name"]: known["default"] for known in _core.camera_parameters_of(env_id)}
    given = {name: value for name, value in keywords.items() if value is not None}
    if "camera_id" in given and "camera_name" in given:
        raise ValueError(
            f"camera_id = {_core.shown(given['camera_id'])} and camera_name = "
            f"{_core.shown(given['camera_name'])}: only one of them can be given"
        )
    free = given.pop("default_camera_config", None)
    if not isinstance(free, (Mapping, type(None))):
        raise TypeError(f"default_camera_config = {_core.shown(free)}: must be a dictionary")
    if "camera_name" in parameters and (render_mode != "human" or "camera_id" in given):
        parameters["camera_name"] = ""
    for name, value in (free or {}).items():
        if name not in (*_FREE_CAMERA, *_IGNORED):
            raise ValueError(
                f"default_camera_config: unknown attribute {_core.shown(name).strip(chr(39))} = "
                f"{_core.shown(value)}; must be one of {', '.join((*_FREE_CAMERA, *_IGNORED))}"
            )
        if name in _FREE_CAMERA:
            parameters[name] = value
            parameters["camera_name"] = ""
    return {**parameters, **given}


class Pictures:
    """Renders walkers of one id and parameters in one render mode.

    Drawing libraries are loaded at the first picture. Copies and unpickled objects draw the same
    pictures with a renderer and a window of their own.

    `render_mode` is None for no pictures, or one of `modes`, by default all of the id; `keywords`
    are the camera's, from `split_keywords`; `dt` is the simulation time of a step [s]. Raises
    ValueError and TypeError that name the mode or the camera's parameter, its value and what is
    allowed.
    """

    def __init__(
        self,
        env_id: str,
        parameters: Mapping[str, Any],
        render_mode: str | None,
        keywords: Mapping[str, Any],
        dt: float,
        modes: Sequence[str] | None = None,
    ) -> None:
        if modes is None:
            modes = _core.registration_of(env_id)["render_modes"]
        if render_mode not in (None, *modes):
            raise ValueError(
                f"render_mode = {_core.shown(render_mode)}: must be None or one of "
                f"{', '.join(modes)}"
            )
        self._mode = render_mode
        self._env_id, self._parameters = env_id, dict(parameters)
        self.camera_parameters = camera_parameters_of(env_id, render_mode, keywords)
        self._window = Window(env_id, dt) if render_mode == "human" else None
        self._renderer: _core.Renderer | None = None
        if render_mode is not None or keywords:
            _ = self.renderer  # checks the parameters

    @property
    def renderer(self) -> _core.Renderer:
        """Renderer of this process; also over ROS, where the server draws, it has the camera."""
        if self._renderer is None:
            self._renderer = _core.Renderer(self._env_id, self._parameters, self.camera_parameters)
        return self._renderer

    def begin(self, draw: Draw) -> None:
        """Shows the first state of an episode in the window."""
        if self._window is not None:
            self._window.begin()
            self.show(draw)

    def follow(self, draw: Draw) -> None:
        """Shows the state after a step in the window, if due; blocks until the step is due."""
        if self._window is not None and self._window.wait():
            self.show(draw)

    def show(self, draw: Draw) -> None:
        """Shows the present state in the window, unless the user has closed it."""
        if self._window is not None and not self._window.is_closed:
            self._window.show(self.colors(draw))

    def render(self, draw: Draw) -> Picture | None:
        """Returns a picture of the render mode. With ``human``, shows it in the window; without a
        mode, logs the same warning as Gymnasium; then returns None."""
        if self._mode is None:
            gymnasium.logger.warn(
                "render: there is no picture, as render_mode is None; choose a mode when the "
                f'environment is made, e.g. gymnasium.make("{NAMESPACE}/{self._env_id}", '
                'render_mode="rgb_array")'
            )
            return None
        if self._mode == "human":
            self.show(draw)
            return None
        if self._mode == "rgb_array":
            return self.colors(draw)
        camera = self.renderer.camera
        size = (camera["height"], camera["width"])
        rgb = np.empty((*size, 3), np.uint8) if self._mode == "rgbd_tuple" else None
        depth = np.empty(size, np.float32)
        draw(self, rgb, depth)
        depth = to_depth_buffer(depth, camera["near"], camera["far"])
        return depth if rgb is None else (rgb, depth)

    def colors(self, draw: Draw) -> NDArray[np.uint8]:
        """Returns a picture, uint8, shape (height, width, 3)."""
        camera = self.renderer.camera
        rgb = np.empty((camera["height"], camera["width"], 3), np.uint8)
        draw(self, rgb, None)
        return rgb

    def close(self) -> None:
        if self._window is not None:
            self._window.close()

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_renderer": None}


def to_depth_buffer(depth: NDArray[np.float32], near: float, far: float) -> NDArray[np.float32]:
    """Converts distances along the optical axis [m] to OpenGL's depth buffer: 0 on the near plane
    to 1 on the far plane, linear in 1 / depth by perspective projection."""
    buffer = (1 / near - 1 / depth.astype(np.float64)) / (1 / near - 1 / far)
    return np.clip(buffer, 0, 1).astype(np.float32)
