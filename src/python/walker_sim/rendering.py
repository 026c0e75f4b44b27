"""Pictures of walkers, in Gymnasium's render modes."""

from __future__ import annotations

from typing import Any, Callable, Mapping, Optional, Sequence, Tuple, Union

import gymnasium
import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.window import Window

Picture = Union[NDArray[Any], Tuple[NDArray[np.uint8], NDArray[np.float32]]]
"""Of rgb_array: uint8, shape (height, width, 3), rows from top to bottom. Of depth_array: float32,
shape (height, width), the depth buffer of OpenGL, 0 near to 1 far. Of rgbd_tuple: both."""

Draw = Callable[
    ["Pictures", Optional[NDArray[np.uint8]], Optional[NDArray[np.float32]]],
    None,
]
"""Draws what a walker shows now into colours and depths [m]; None: not wanted."""

# Attributes of MuJoCo's mjvCamera that describe a free camera. The others it has choose another
# kind, or are for one; Gymnasium takes those too, and looks through its free camera all the same.
_FREE_CAMERA = ("distance", "lookat", "elevation", "azimuth")
_IDLE = ("type", "fixedcamid", "trackbodyid")

ALL_MODES = ("human", "rgb_array", "depth_array", "rgbd_tuple")


def render_modes_of(env_id: str) -> list[str]:
    """Those of Gymnasium's own environment of this id."""
    modes: list[str] = _core.registration_of(env_id)["render_modes"]
    return modes


def metadata_of(specification: Mapping[str, Any]) -> dict[str, Any]:
    """What Gymnasium's environments say of their pictures."""
    return {
        "render_modes": render_modes_of(specification["id"]),
        "render_fps": round(1 / specification["dt"]),
    }


def camera_keywords_of(env_id: str) -> set[str]:
    """Those with which an environment's camera is chosen.

    Raises
    ------
    ValueError
        For an unknown id.
    """
    names = {known["name"] for known in _core.camera_parameters_of(env_id)} - {*_FREE_CAMERA}
    if _core.registration_of(env_id)["takes_default_camera_config"]:
        names.add("default_camera_config")
    return names


def split_keywords(
    env_id: str, keywords: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """The environment's own parameters, and those of its camera.

    Raises
    ------
    ValueError
        For an unknown id.
    """
    names = camera_keywords_of(env_id)
    camera = {name: value for name, value in keywords.items() if name in names}
    return {name: keywords[name] for name in keywords if name not in camera}, camera


def camera_parameters_of(
    env_id: str, render_mode: str | None, keywords: Mapping[str, Any]
) -> dict[str, Any]:
    """All parameters of the core's camera, from the camera's keywords.

    Without a choice it is Gymnasium's free camera, which stays where it is; a window's follows.

    Raises
    ------
    ValueError
        For two cameras, or an unknown attribute of the free one.
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
        if name not in (*_FREE_CAMERA, *_IDLE):
            raise ValueError(
                f"default_camera_config: unknown attribute {_core.shown(name).strip(chr(39))} = "
                f"{_core.shown(value)}; must be one of {', '.join((*_FREE_CAMERA, *_IDLE))}"
            )
        if name in _FREE_CAMERA:
            parameters[name] = value
            parameters["camera_name"] = ""
    return {**parameters, **given}


class Pictures:
    """What a render mode gives of walkers of one kind.

    Nothing is loaded before the first picture. A copy, and what comes out of a pickle, draws the
    same with a renderer and a window of its own.

    Parameters
    ----------
    env_id, parameters
        As the walkers were made.
    render_mode
        None: there are no pictures.
    keywords
        The camera's, as `split_keywords` gives them.
    dt
        Simulation time of a step [s].
    modes
        The modes to choose from; None: all that the id has.

    Raises
    ------
    ValueError, TypeError
        Naming the mode or the camera's parameter, its value and what is allowed.
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
            modes = render_modes_of(env_id)
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
            _ = self.renderer  # refuses what cannot be

    @property
    def renderer(self) -> _core.Renderer:
        """Draws in this process, and knows the camera in any case."""
        if self._renderer is None:
            self._renderer = _core.Renderer(self._env_id, self._parameters, self.camera_parameters)
        return self._renderer

    def begin(self, draw: Draw) -> None:
        """Shows the first instant of an episode in the window."""
        if self._window is not None:
            self._window.begin()
            self.show(draw)

    def follow(self, draw: Draw) -> None:
        """Shows the instant after a step in the window, when its time has come."""
        if self._window is None:
            return
        is_due = self._window.is_picture_due()
        self._window.wait()
        if is_due:
            self.show(draw)

    def show(self, draw: Draw) -> None:
        """Shows an instant in the window, unless the user has closed that."""
        if self._window is not None and not self._window.is_closed:
            self._window.show(self.colors(draw))

    def take(self, draw: Draw) -> Picture:
        """What `render` returns in a mode that gives pictures."""
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
        """Shape (height, width, 3)."""
        camera = self.renderer.camera
        rgb = np.empty((camera["height"], camera["width"], 3), np.uint8)
        draw(self, rgb, None)
        return rgb

    def close(self) -> None:
        """Closes the window, if there is one."""
        if self._window is not None:
            self._window.close()

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_renderer": None}


def to_depth_buffer(depth: NDArray[np.float32], near: float, far: float) -> NDArray[np.float32]:
    """What OpenGL's depth buffer has for distances along the optical axis.

    Parameters
    ----------
    depth
        [m]
    near, far
        The planes that bound what is drawn [m].

    Returns
    -------
    From 0, on the near plane, to 1, on the far one; linear in 1 / depth, as the perspective
    projection makes it.
    """
    buffer = (1 / near - 1 / depth.astype(np.float64)) / (1 / near - 1 / far)
    return np.clip(buffer, 0, 1).astype(np.float32)


def warn_of_no_mode(name: str) -> None:
    """Says, as Gymnasium's environments do, why `render` gives nothing."""
    gymnasium.logger.warn(
        "render: there is no picture, as render_mode is None; choose a mode when the environment "
        f'is made, e.g. gymnasium.make("{name}", render_mode="rgb_array")'
    )
