"""The panel beside the view: buttons, worlds, policies, plots."""

from __future__ import annotations

import functools
import importlib
import math
import queue
from typing import Any, Callable, Protocol, Sequence

import numpy as np

from walker_sim import _core
from walker_sim.worlds import World, to_world

SPEEDS = ("1/16", "1/8", "1/4", "1/2", "1", "2", "4", "8", "16")
USUAL_MAXIMUM = {
    "push_interval": 10.0,
    "range_noise": 1.0,
    "action_noise": 1.0,
    "joint_position_noise": 1.0,
    "joint_velocity_noise": 5.0,
    "angular_velocity_noise": 5.0,
    "linear_velocity_noise": 5.0,
}
"""Ends of sliders whose parameter allows so much that a slider could not set what is of use. The
text sets the rest."""
PLOTTED = 500  # latest steps
PUSHES = {"arrowleft": (-1, 0), "arrowright": (1, 0), "arrowup": (0, 1), "arrowdown": (0, -1)}
"""Ways along x and z, by key."""


class Walker(Protocol):
    """What the panel asks of the walker that it steers. Each may raise an error, which is shown to
    the browser that has asked."""

    def pause(self) -> None: ...
    def step_once(self) -> None: ...
    def repeat(self) -> None: ...
    def begin_next(self) -> None: ...
    def begin(self, seed: int) -> None: ...
    def set_speed(self, speed: float) -> None: ...
    def set_world(self, world: World) -> None: ...
    def set_policy(self, name: str) -> None: ...
    def load_policy(self, name: str, content: bytes) -> None: ...
    def push(self, way: Sequence[float]) -> None: ...
    def save(self) -> tuple[str, bytes]: ...


class Panel:
    """Elements that all browsers share.

    What a browser asks for waits until `handle` is called, in the thread that steps the walker.
    """

    def __init__(
        self, server: Any, env_id: str, joints: Sequence[str], walker: Walker, policies: list[str]
    ) -> None:
        self._server, self._env_id, self._walker = server, env_id, walker
        self._world: World = {}
        self._waiting: queue.SimpleQueue[tuple[Callable[[], Any], Any]] = queue.SimpleQueue()
        self._refused: tuple[type[Exception], ...] = (ValueError, TypeError, RuntimeError)
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.gui.main_panel.dock_right()
        self._status = server.gui.add_markdown("")
        self._add_buttons()
        self._add_policies(policies)
        self._add_worlds()
        self._add_plots(joints)

    def refuse(self, *errors: type[Exception]) -> None:
        """Adds errors that are shown in the browser instead of being raised by `handle`."""
        self._refused += errors

    def handle(self) -> None:
        """Does what browsers have asked for."""
        while not self._waiting.empty():
            function, client = self._waiting.get()
            try:
                function()
            except self._refused as error:
                if client is not None:
                    client.add_notification("Refused", str(error), color="red")

    def show_status(self, text: str) -> None:
        if text != self._status.content:
            self._status.content = text

    def show_world(self, world: World) -> None:
        """Shows the world of the episodes to come."""
        self._world = world
        self._text.value = _core.world_text(world)
        for name, slider in self._sliders.items():
            if name in world:
                slider.value = min(max(world[name][0], slider.min), slider.max)

    def plot(self, returns: Sequence[float], angles: Sequence[Sequence[float]]) -> None:
        """Shows the return [-] and the joints' angles [rad] after each step."""
        first = max(0, len(returns) - PLOTTED)
        steps = np.arange(first, len(returns), dtype=float)
        self._returns.data = (steps, np.array(returns[first:], float))
        columns = np.array(angles[first:], float).reshape(len(steps), -1).T
        self._angles.data = (steps, *map(np.ascontiguousarray, columns))

    def ask(self, function: Callable[[], Any], client: Any = None) -> None:
        """Has a function called by the thread that steps the walker."""
        self._waiting.put((function, client))

    def _on(self, function: Callable[..., Any], *arguments: Any) -> Callable[[Any], None]:
        """Returns a callback for an element."""
        return lambda event: self.ask(functools.partial(function, *arguments), event.client)

    def _add_buttons(self) -> None:
        gui, walker = self._server.gui, self._walker
        actions: dict[str, tuple[str, Callable[[], None]]] = {
            "pause": ("space", walker.pause),
            "step": ("S", walker.step_once),
            "repeat": ("R", walker.repeat),
            "next": ("N", walker.begin_next),
        }
        keys = ", ".join(f"{name}: {key}" for name, (key, _) in actions.items())
        row = gui.add_button_group("Episode", tuple(actions), hint=f"keys: {keys}")
        row.on_click(lambda event: self.ask(actions[event.target.value][1], event.client))
        for name, (key, action) in actions.items():
            gui.add_command(name.capitalize(), hotkey=key).on_trigger(self._on(action))
        for key, way in PUSHES.items():
            label = f"Push, {key[len('arrow') :]}"
            gui.add_command(label, hotkey=key).on_trigger(self._on(walker.push, way))
        seed = gui.add_text("Seed", "0")
        begin = gui.add_button("Begin this seed's episode")
        begin.on_click(self._on(lambda: walker.begin(to_seed(seed.value))))
        speed = gui.add_dropdown("Speed", SPEEDS, initial_value="1")
        speed.on_update(self._on(lambda: walker.set_speed(to_speed(speed.value))))
        gui.add_button("Save episode", hint="a file that repeats to the bit").on_click(
            lambda event: self.ask(
                lambda: event.client.send_file_download(*walker.save()), event.client
            )
        )

    def _add_policies(self, names: list[str]) -> None:
        gui, walker = self._server.gui, self._walker
        if not names:
            return
        policy = gui.add_dropdown("Policy", names, hint="acts from the next episode on")
        policy.on_update(self._on(lambda: walker.set_policy(policy.value)))
        file = gui.add_upload_button("Policy from a file", mime_type=".safetensors")
        file.on_upload(self._on(lambda: walker.load_policy(file.value.name, file.value.content)))

    def _add_worlds(self) -> None:
        gui, env_id = self._server.gui, self._env_id
        self._sliders: dict[str, Any] = {}
        with gui.add_folder("World", expand_by_default=False):
            gui.add_markdown("Acts from the next episode on.")
            preset = gui.add_dropdown("Preset", presets_of(env_id))
            preset.on_update(self._on(lambda: self._set_world(to_world(env_id, preset.value))))
            self._text = gui.add_text("Text", "{}", multiline=True, hint="as for --world")
            gui.add_button("Set the text's world").on_click(self._on(self._read_world))
            for parameter in _core.world_parameters(env_id):
                self._add_slider(parameter)

    def _add_slider(self, parameter: dict[str, Any]) -> None:
        name, low, high = parameter["name"], parameter["minimum"], parameter["maximum"]
        high = USUAL_MAXIMUM.get(name, high)
        value = low if math.isnan(parameter["default"]) else parameter["default"]
        step = 1.0 if parameter["is_whole"] else (high - low) / 1000
        unit = f" [{parameter['unit']}]" if parameter["unit"] else ""
        slider = self._server.gui.add_slider(
            name + unit,
            min=low,
            max=high,
            step=step,
            initial_value=min(max(value, low), high),
            hint=parameter["description"],
        )
        self._sliders[name] = slider

        def set_value() -> None:
            self._set_world({**self._world, name: (slider.value, slider.value)})

        # Values that the page itself sets come from no browser.
        def take(event: Any) -> None:
            if event.client is not None:
                self.ask(set_value, event.client)

        slider.on_update(take)

    def _read_world(self) -> None:
        world = _core.parse_world(self._text.value.encode("utf-8", "surrogatepass"), "of the page")
        _core.check_world(self._env_id, world)
        self._set_world(world)

    def _set_world(self, world: World) -> None:
        try:
            self._walker.set_world(world)
            self._world = world
        finally:
            self.show_world(self._world)

    def _add_plots(self, joints: Sequence[str]) -> None:
        gui, uplot = self._server.gui, importlib.import_module("viser.uplot")
        nothing = np.zeros(1)
        colors = ("#1f77b4", "#d62728", "#2ca02c", "#ff7f0e", "#9467bd", "#8c564b")

        def plot(title: str, names: Sequence[str]) -> Any:
            series = [uplot.Series(label="step")]
            for name, color in zip(names, colors):
                series.append(uplot.Series(label=name, stroke=color, width=2))
            return gui.add_uplot(
                data=(nothing,) * (1 + len(names)),
                series=tuple(series),
                title=title,
                scales={"x": uplot.Scale(time=False), "y": uplot.Scale(auto=True)},
                aspect=2.0,
            )

        with gui.add_folder("Plots"):
            self._returns = plot("return", ["return"])
            self._angles = plot("joint angles [rad]", joints)


def presets_of(env_id: str) -> list[str]:
    """Returns the presets that the environment can apply, the plain one first."""
    presets = []
    for name in _core.world_presets():
        try:
            to_world(env_id, name)
        except ValueError:
            continue
        presets.append(name)
    return sorted(presets, key=lambda name: name != "gymnasium")


def to_seed(text: str) -> int:
    if not text.strip().isdecimal() or int(text) >= 2**64:
        raise ValueError(f"seed = {text!r}: must be a whole number from 0 to {2**64 - 1}")
    return int(text)


def to_speed(text: str) -> float:
    numerator, _, denominator = text.partition("/")
    return float(numerator) / float(denominator or 1)
