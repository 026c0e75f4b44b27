"""The three-dimensional view: a walker and its surroundings, as rviz shows them."""

from __future__ import annotations

import importlib
from typing import Any, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

SKY = (0.84, 0.89, 1.0)
SLOWNESS = 0.02
"""Share of the height difference to the trunk that the view makes up in each picture."""

PUSH_PER_METRE = 0.1
"""Push for each step and metre of a drag, as a multiple of a key's push."""
MAX_DRAG = 20.0  # [m]

Drawing = Mapping[str, Any]
"""Coloured triangles, lines, spheres or a text, as `StateCapture` returns them."""


class Scene:
    """What every browser sees. The world moves past the walker, so that each viewer's camera stays
    where the viewer has put it.

    `links` are the robot's, as `link_shapes` returns them.
    """

    def __init__(self, server: Any, links: Sequence[Mapping[str, Any]]) -> None:
        self._server, self._scene = server, server.scene
        self._handles: dict[str, Any] = {}
        self._height: float | None = None  # that the view follows [m]
        self._scene.set_up_direction("+z")
        self._scene.set_background_image(np.full((1, 1, 3), to_bytes(SKY), np.uint8))
        self._scene.configure_environment_map(None)  # the default one comes from the internet
        self._scene.add_light_ambient("/light/around", intensity=2.0)
        self._scene.add_light_directional(
            "/light/viewer", intensity=2.0, position=(-2.0, -5.0, 2.0)
        )
        self._world = self._scene.add_frame("/world", show_axes=False)
        self._beside = self._scene.add_frame("/world/beside", show_axes=False)
        self._links = []
        self.trunk: list[Any] = []
        """Handles of the trunk's meshes."""
        for link in links:
            name = f"/world/links/{link['name']}"
            self._links.append(self._scene.add_frame(name, show_axes=False))
            for index, mesh in enumerate(link["meshes"]):
                handle = self._scene.add_mesh_simple(
                    f"{name}/{index}",
                    mesh["vertices"],
                    mesh["faces"],
                    color=to_bytes(mesh["color"]),
                    flat_shading=True,
                )
                self.trunk += [handle] if len(self._links) == 1 else []

    def begin(self, drawings: Sequence[Drawing]) -> None:
        """Shows the surroundings of a new episode, without a path."""
        self._height = None
        with self._server.atomic():
            for handle in self._handles.values():
                handle.remove()
            self._handles.clear()
            for drawing in drawings:
                self._draw(drawing)

    def show(self, poses: NDArray[np.float64], drawings: Sequence[Drawing]) -> None:
        """Shows a state: the links' poses, shape (links, 7), position [m] and quaternion w, x, y,
        z, and what surrounds them."""
        if not np.isfinite(poses).all():
            return
        trunk = poses[0, :3]
        if self._height is None:
            self._height = trunk[2]
            self._place_camera(trunk[2] - poses[:, 2].min())
        self._height += SLOWNESS * (trunk[2] - self._height)
        with self._server.atomic():
            self._world.position = (-trunk[0], 0.0, -self._height)
            for frame, pose in zip(self._links, poses):
                frame.position, frame.wxyz = pose[:3], pose[3:]
            self._beside.position = trunk
            for drawing in drawings:
                if drawing["kind"] in ("triangles", "line_strip"):  # floor and path
                    self._draw(drawing)
                else:  # the library moves a frame sooner than it changes what is in it
                    moved = {**drawing, "points": drawing["points"] - trunk}
                    self._draw(moved, "/world/beside")

    def _place_camera(self, size: float) -> None:
        """Places the camera of browsers to come, for a walker whose legs have this length [m]."""
        camera = self._server.initial_camera
        camera.position = (0.9 * size, -6.0 * size, 1.2 * size)
        camera.look_at = (0.9 * size, 0.0, 0.0)

    def _draw(self, drawing: Drawing, frame: str = "/world") -> None:
        name, kind, points = drawing["name"], drawing["kind"], drawing["points"]
        handle = self._handles.pop(name, None)
        if kind == "text" or len(points) == 0:  # the panel has the text
            if handle is not None:
                handle.remove()
            return
        colors = colors_of(drawing)
        place = f"{frame}/{name}"
        if kind == "triangles":
            handle = self._scene.add_glb(place, to_glb(points, colors), cast_shadow=False)
        elif kind == "spheres":
            if handle is None:
                handle = self._scene.add_point_cloud(
                    place, points, colors, point_size=drawing["size"] / 2, point_shape="circle"
                )
            else:
                handle.points, handle.colors = points, colors
        else:
            if kind == "line_strip":
                points, colors = (np.repeat(each, 2, axis=0)[1:-1] for each in (points, colors))
            segments, shades = points.reshape(-1, 2, 3), colors.reshape(-1, 2, 3)
            if handle is None:
                handle = self._scene.add_line_segments(
                    place, segments, shades, thickness=drawing["size"]
                )
            else:
                handle.points, handle.colors = segments, shades
        self._handles[name] = handle


class Drag:
    """A drag of meshes. `offset` leads from the grabbed point to the pointer, along x and z [m]."""

    def __init__(self, meshes: Sequence[Any]) -> None:
        self.offset: NDArray[np.float64] = np.zeros(2)
        for mesh in meshes:
            mesh.on_drag(self.take)

    async def take(self, event: Any) -> None:
        offset = np.subtract(event.end_position, event.start_position)[[0, 2]]
        is_held = event.phase != "end" and bool(np.isfinite(offset).all())
        self.offset = np.clip(offset, -MAX_DRAG, MAX_DRAG) if is_held else np.zeros(2)

    def push(self) -> NDArray[np.float64]:
        """Returns the push for one step, along x and z, 1 for a key's."""
        return PUSH_PER_METRE * self.offset


def to_glb(points: NDArray[np.float32], colors: NDArray[np.uint8]) -> bytes:
    """Returns triangles as a binary glTF file, shown from both sides and, as in rviz, without
    light: the colours have all shades."""
    trimesh = importlib.import_module("trimesh")
    share = colors / 255  # of sRGB; glTF's colours are linear
    linear = np.where(share > 0.04045, ((share + 0.055) / 1.055) ** 2.4, share / 12.92)
    shown = np.rint(255 * linear).astype(np.uint8)
    faces = np.arange(len(points)).reshape(-1, 3)
    mesh = trimesh.Trimesh(points, faces, vertex_colors=shown, process=False)

    def unlit(tree: dict[str, Any]) -> None:
        extension = "KHR_materials_unlit"
        tree["materials"] = [{"doubleSided": True, "extensions": {extension: {}}}]
        tree["meshes"][0]["primitives"][0]["material"] = 0
        tree["extensionsUsed"] = [extension]

    content: bytes = trimesh.exchange.gltf.export_glb(trimesh.Scene(mesh), tree_postprocessor=unlit)
    return content


def to_bytes(color: Sequence[float]) -> tuple[int, ...]:
    """Returns red, green and blue from 0 to 255."""
    return tuple(np.rint(255 * np.asarray(color[:3])).astype(int).tolist())


def colors_of(drawing: Drawing) -> NDArray[np.uint8]:
    """Returns a colour for each point, shape (n, 3). What is transparent is mixed with the sky."""
    colors = drawing["colors"]
    if colors is None:
        colors = np.tile(drawing["color"], (len(drawing["points"]), 1))
    opacity = colors[:, 3:]
    mixed = opacity * colors[:, :3] + (1 - opacity) * np.array(SKY)
    shown: NDArray[np.uint8] = np.rint(255 * mixed).astype(np.uint8)
    return shown
