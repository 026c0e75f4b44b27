"""The panel beside the view: buttons, worlds, policies, plots."""

from __future__ import annotations

import contextlib
import functools
import importlib
import math
import queue
import re
import traceback
from typing import Any, Callable, Iterable, Protocol, Sequence

import numpy as np

from walker_sim import _core
from walker_sim.commands.options import InputError
from walker_sim.commands.policies import PolicyFailed
from walker_sim.worlds import World, ends_of, to_world

PANEL_INTERVAL = 0.2  # between updates of plots and status [s of wall time]
PLOTTED = 500  # latest pictures
OTHER = "other"  # entry of the presets: the world is none of them, or was changed
MAX_MESSAGE = 1000  # length of an error's text
PUSHES = {"up": ("I", 0, 1), "left": ("J", -1, 0), "down": ("K", 0, -1), "right": ("L", 1, 0)}
"""Keys and ways along x and z. viser's camera has the arrows, W, A, S, D, Q and E."""


def text_of(drawn: World) -> str:
    """Returns what an episode has drawn, as short as it is shown."""
    texts = []
    for name, given in drawn.items():
        low, high = ends_of(given)
        scale = " (log)" if isinstance(given, dict) else ""
        texts.append(f"{name} {low:.3g}" + (f" to {high:.3g}{scale}" if low < high else ""))
    return ", ".join(texts)


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
    def push(self, way: Sequence[float]) -> None: ...
    def save(self) -> tuple[str, bytes]: ...


class PolicyChooser(Protocol):
    """What chooses the policy of the episodes to come, with errors as those of `Walker`."""

    def set_policy(self, name: str) -> None: ...
    def load_policy(self, name: str, content: bytes) -> None: ...
    @property
    def policy(self) -> str: ...


class Panel:
    """Elements that all browsers share.

    What a browser asks for waits until `handle` is called, in the thread that steps the walker. A
    browser may send any value for an element, so each is checked here.
    """

    def __init__(
        self,
        server: Any,
        env_id: str,
        joints: Sequence[str],
        walker: Walker,
        saved: str = "a file that `record --check` repeats",
    ) -> None:
        self._server, self._env_id, self._walker, self._saved = server, env_id, walker, saved
        self.world: World = {}  # that is shown
        self._plotted_episode = 0
        self._points: dict[int, tuple[float, ...]] = {}  # return and angles, by the step
        self._waiting: queue.SimpleQueue[tuple[Callable[[], Any], Any]] = queue.SimpleQueue()
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.gui.main_panel.dock_right()
        self._status = server.gui.add_markdown("")
        self._add_buttons()
        self._policy_folder = server.gui.add_folder("Policy", visible=False)
        self._add_worlds()
        self._add_plots(joints)

    def add_policies(self, chooser: PolicyChooser, policies: list[str]) -> None:
        """Adds the choice of a policy: one of these names, or a file."""
        gui = self._server.gui
        self._policy_folder.visible = True
        with self._policy_folder:
            hint = "acts from the next episode on"
            self._policy = gui.add_dropdown("Policy", policies, hint=hint)
            file = gui.add_upload_button("Policy from a file", mime_type=".safetensors")

        def choose(name: str) -> None:
            try:
                chooser.set_policy(one_of(name, self._policy.options))
            finally:
                self._policy.value = chooser.policy

        def load(name: str, content: bytes) -> None:
            chooser.load_policy(name, content)
            self._policy.options = list(dict.fromkeys([*self._policy.options, name]))
            self._policy.value = chooser.policy

        self._policy.on_update(self._on(choose))
        file.on_upload(self._on(load, "name", "content"))

    def handle(self) -> None:
        """Does what browsers have asked for. An error is shown to the one that has asked."""
        while not self._waiting.empty():
            function, client = self._waiting.get()
            try:
                function()
            except Exception as error:
                refuse(client, error)

    def tell_all(self, error: Exception) -> None:
        """Shows an error to every browser."""
        for client in self._server.get_clients().values():
            refuse(client, error)

    def show_status(self, text: str) -> None:
        if text != self._status.content:
            self._status.content = text

    def show_speed(self, speed: float) -> None:
        if speed != self._speed.value:
            self._speed.value = speed

    def show_world(self, world: World) -> None:
        """Shows the world of the episodes to come. A slider shows a range's lower end."""
        self.world = world
        self._text.value = _core.world_text(world)
        self._preset.value = OTHER
        for name, (slider, default) in self._sliders.items():
            value = ends_of(world[name])[0] if name in world else default
            slider.value = min(max(value, slider.min), slider.max)

    def add_point(
        self, episode: int, step: int, episode_return: float, angles: Sequence[float]
    ) -> None:
        """Takes the return [-] and the joints' angles [rad] after a step for the plots."""
        if episode != self._plotted_episode or step < next(reversed(self._points), 0):
            self._plotted_episode, self._points = episode, {}
        self._points[step] = (episode_return, *angles)
        if len(self._points) > PLOTTED:
            del self._points[next(iter(self._points))]

    def plot(self) -> None:
        """Shows the points, if there are others than before."""
        rows = np.array([(step, *values) for step, values in self._points.items()], float)
        if len(rows) > 0 and not np.array_equal(rows[:, :2].T, self._returns.data):
            steps, returns, *angles = map(np.ascontiguousarray, rows.T)
            self._returns.data, self._angles.data = (steps, returns), (steps, *angles)

    def _on(self, function: Callable[..., Any], *names: str) -> Callable[[Any], Any]:
        """Returns a callback for an element: the function is called with these attributes of the
        element's value, none: with its value, when it is this thread's turn."""

        async def take(event: Any) -> None:  # in the order in which browsers ask
            if event.client is None:  # the page itself has set the value
                return
            value = getattr(event.target, "value", None)
            values = [getattr(value, name) for name in names] if names else [value]
            self._waiting.put((functools.partial(function, *values), event.client))

        return take

    def _add_buttons(self) -> None:
        gui, walker = self._server.gui, self._walker
        actions: dict[str, tuple[str, Callable[[], None]]] = {
            "pause": ("space", walker.pause),
            "step": ("F", walker.step_once),
            "repeat": ("R", walker.repeat),
            "next": ("N", walker.begin_next),
        }
        keys = ", ".join(f"{name}: {key}" for name, (key, _) in actions.items())
        row = gui.add_button_group("Episode", tuple(actions), hint=f"keys: {keys}")
        row.on_click(self._on(lambda name: actions[one_of(name, actions)][1]()))
        for name, (key, action) in actions.items():
            self._add_key(name.capitalize(), key, action)
        for way, (key, x, z) in PUSHES.items():
            self._add_key(f"Push {way}", key, functools.partial(walker.push, (x, z)))
        seed = gui.add_text("Seed", "0")
        begin = gui.add_button("Begin this seed's episode")
        begin.on_click(self._on(lambda _: walker.begin(to_seed(seed.value))))
        self._speed = gui.add_number("Speed", 1.0, step=0.01, hint="simulation time over wall time")
        self._speed.on_update(self._on(lambda speed: walker.set_speed(float(speed))))
        save = gui.add_button("Save episode", hint=self._saved)

        async def download(event: Any) -> None:
            self._waiting.put(
                (lambda: event.client.send_file_download(*walker.save()), event.client)
            )

        save.on_click(download)

    def _add_key(self, label: str, key: str, action: Callable[[], Any]) -> None:
        command = self._server.gui.add_command(label, hotkey=key)
        command.on_trigger(self._on(lambda _: action()))

    def _add_worlds(self) -> None:
        gui, env_id = self._server.gui, self._env_id
        presets = presets_of(env_id)
        self._sliders: dict[str, tuple[Any, float]] = {}

        def choose(name: str) -> None:
            if name != OTHER:
                self._set_world(lambda: to_world(env_id, one_of(name, presets)))

        with gui.add_folder("World", expand_by_default=False):
            gui.add_markdown("Acts from the next episode on.")
            self._preset = gui.add_dropdown("Preset", [OTHER, *presets])
            self._preset.on_update(self._on(choose))
            self._text = gui.add_text("Text", "{}", multiline=True, hint="as for --world")
            button = gui.add_button("Set the text's world")
            button.on_click(self._on(lambda _: self._set_world(self._read_world)))
            for parameter in _core.world_parameters(env_id):
                if parameter["name"] != "change_interval":  # needs a range, which no slider sets
                    self._add_slider(parameter)

    def _add_slider(self, parameter: dict[str, Any]) -> None:
        name, low, high = parameter["name"], parameter["minimum"], parameter["maximum"]
        # Some ranges are too wide for useful steps. The text field accepts larger values.
        if name.endswith("_noise"):
            high = min(high, 5.0 if parameter["unit"].endswith("/s") else 1.0)
        elif name == "push_interval":
            high = 10.0
        value = low if math.isnan(parameter["default"]) else parameter["default"]
        value = min(max(value, low), high)
        unit = f" [{parameter['unit']}]" if parameter["unit"] else ""
        slider = self._server.gui.add_slider(
            name + unit,
            min=low,
            max=high,
            step=1.0 if parameter["is_whole"] else (high - low) / 1000,
            initial_value=value,
            hint=parameter["description"],
        )
        self._sliders[name] = slider, value

        def choose(number: float) -> None:
            world = {**self.world, name: (number, number)}
            self._set_world(lambda: to_world(self._env_id, world))

        slider.on_update(self._on(choose))

    def _read_world(self) -> World:
        text = self._text.value.encode("utf-8", "surrogatepass")
        world = _core.parse_world(text, "of the page")
        _core.check_world(self._env_id, world)
        return world

    def _set_world(self, make: Callable[[], World]) -> None:
        """Sets a world. If it is refused, the page shows the one before again."""
        try:
            world = make()
            self._walker.set_world(world)
            self.world = world
        finally:
            self.show_world(self.world)

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


def refuse(client: Any, error: Exception) -> None:
    """Shows an error in a browser. One that is not about what was asked is a fault of this program,
    so that its place is printed too."""
    if not isinstance(error, (ValueError, TypeError, RuntimeError, InputError, PolicyFailed)):
        traceback.print_exception(type(error), error, error.__traceback__)
    client.add_notification("Refused", str(error)[:MAX_MESSAGE], color="red")


def one_of(value: str, options: Iterable[str]) -> str:
    """Returns a value that is among the options; ValueError if it is not."""
    options = list(options)
    if value not in options:
        raise ValueError(f"{_core.shown(value)}: must be one of {', '.join(options)}")
    return value


def presets_of(env_id: str) -> list[str]:
    """Returns the presets that the environment can apply, the plain one first."""
    presets = []
    for name in _core.world_presets():
        with contextlib.suppress(ValueError):
            to_world(env_id, name)
            presets.append(name)
    return sorted(presets, key=lambda name: name != "gymnasium")


def to_seed(text: str) -> int:
    if not re.fullmatch(r" *[0-9]{1,20} *", text) or int(text) >= 2**64:
        raise ValueError(
            f"seed = {_core.shown(text)}: must be a whole number from 0 to {2**64 - 1}"
        )
    return int(text)
