"""Plays the scripts of scripts.txt, as promises.h does in C++, and compares traces."""

import functools
import os
import pathlib
import struct
import subprocess
from typing import NamedTuple

import yaml

FILE = pathlib.Path(__file__).with_name("scripts.txt")
NUM_WALKERS = 3
ALL = [*range(NUM_WALKERS)]
BITS = (1 << 64) - 1


class Case(NamedTuple):
    name: str
    env_id: str
    parameters: dict
    level: object  # a preset's name, or ranges by name


class Call(NamedTuple):
    name: str
    walkers: list
    argument: str


def read_world(text):
    return yaml.safe_load(text) if text.startswith("{") else text


def read_case(text):
    text, _, level = text.partition(" | ")
    name, env_id, *words = text.split()
    parameters = {}
    for word in words:
        key, _, value = word.partition("=")
        parameters[key] = value if key == "model" else yaml.safe_load(value)
    return Case(name, env_id, parameters, read_world(level))


def read_scripts():
    """Returns the cases by name, and the calls of each script by its name."""
    cases, scripts = {}, {}
    for line in FILE.read_text().splitlines():
        name, _, rest = line.partition(" ")
        if name == "case":
            case = read_case(rest)
            cases[case.name] = case
        elif name == "script":
            calls = scripts[rest] = []
        elif name == "step":
            calls.append(Call(name, [], rest))
        elif name not in ("", "#"):
            words, _, argument = rest.partition(" ")
            walkers = ALL if words == "*" else [int(word) for word in words.split(",")]
            calls.append(Call(name, walkers, argument))
    return cases, scripts


CASES, SCRIPTS = read_scripts()


def resets_all(script):
    """Returns whether each reset is of all walkers."""
    return all(call.walkers == ALL for call in SCRIPTS[script] if call.name == "reset")


def has_states(script):
    """Returns whether the script saves states."""
    return any(call.name == "save" or call.argument == "state" for call in SCRIPTS[script])


def sets_coordinates(script):
    return any(call.name == "set" for call in SCRIPTS[script])


def write_model(case, folder):
    """Returns the case's parameters; writes its changed model, if it has one, into the folder."""
    parameters = dict(case.parameters)
    if "model" in parameters:
        old, new = parameters.pop("model").split("->")
        text = (FILE.parents[2] / "assets/walker2d_v5.xml").read_text()
        assert old in text
        path = pathlib.Path(folder) / "changed.xml"
        path.write_text(text.replace(old, new))
        parameters["xml_file"] = str(path)
    return parameters


@functools.lru_cache(maxsize=None)
def oracle(case, resets_at_once):
    """Returns the lines of each walker, by script."""
    program = f"{os.environ['WALKER_SIM_PROGRAMS']}/walker_sim_oracle"
    when = "at_once" if resets_at_once else "in_step"
    output = subprocess.run([program, case, when], stdout=subprocess.PIPE, check=True).stdout
    traces = {script: [[] for _ in ALL] for script in SCRIPTS}
    for line in output.decode().splitlines():
        script, walker, text = line.split("\t")
        traces[script][int(walker)].append(text)
    return traces


def action_value(step, walker, joint):
    """A value in [-1.25, 1.25), exact in single precision, by SplitMix64."""
    bits = ((step << 16) + (walker << 8) + joint + 1) * 0x9E3779B97F4A7C15 & BITS
    bits = (bits ^ bits >> 30) * 0xBF58476D1CE4E5B9 & BITS
    bits = (bits ^ bits >> 27) * 0x94D049BB133111EB & BITS
    return (((bits ^ bits >> 31) >> 44) - 524288) * 5 / 2097152


def hexadecimal(value):
    return struct.pack(">d", value).hex()


def text_of(observation):
    return "".join(f" {hexadecimal(value)}" for value in observation)


def world_text(drawn):
    text = ""
    for name in sorted(drawn):
        given = drawn[name]["log"] if isinstance(drawn[name], dict) else drawn[name]
        ends = given if isinstance(given, tuple) else (given,)
        text += f" world {name}=" + ":".join(map(hexadecimal, ends))
    return text


class Interface:
    """Walkers behind an interface. Each call appends to the trace.

    A subclass has reset(walkers, seed), step(actions), set_world(walker, world), save(walker) and
    load(walker, state) if it has states, and set_coordinates(walker, position, velocity) if it can.
    """

    resets_at_once = True

    def __init__(self, action_size, info_names):
        self.action_size, self.info_names = action_size, info_names
        self.trace = [[] for _ in ALL]
        self.drawn = [{} for _ in ALL]
        self.has_ended = [False] * NUM_WALKERS
        self.saved = {}  # has_ended, by state

    def add_reset(self, walker, observation, info):
        """@param info: values by name, `world`, and `error` if the engine has failed"""
        self.has_ended[walker] = "error" in info
        self.drawn[walker] = world = info.get("world", {})
        if "error" in info:
            line = f"reset failed: {info['error']}"
        else:
            line = "reset" + text_of(observation) + self.info_text(info)
            line += world_text(world)
        self.trace[walker].append(line)

    def add_step(self, walker, observation, reward, terminated, truncated, info):
        self.has_ended[walker] = bool(terminated or truncated)
        flags = {"terminated": terminated, "truncated": truncated}
        line = f"step{text_of(observation)} reward={hexadecimal(reward)}"
        line += "".join(f" {flag}" for flag, is_set in flags.items() if is_set)
        line += self.info_text(info)
        self.trace[walker].append(line + (f" failed: {info['error']}" if "error" in info else ""))

    def info_text(self, info):
        return "".join(
            f" {name}={hexadecimal(info[name])}" for name in self.info_names if name in info
        )

    def reported(self, line):
        """Returns an expected line as the interface reports it."""
        return line

    def keep(self, walker, state):
        self.saved[state] = self.has_ended[walker]
        return state

    def prepare(self, step):
        """Is called before each step with its number, from 1."""

    def set_state(self, walker, step):
        """Sets a standing robot's state. Refused: by a robot without coordinates, and by a failed
        walker."""
        values = [action_value(step, walker, i) for i in range(32)]
        position = [value / 16 for value in values[: self.action_size + 3]]
        position[1] += 1.25
        velocity = [value / 4 for value in values[16:][: self.action_size + 3]]
        try:
            self.set_coordinates(walker, position, velocity)
        except RuntimeError:  # if it should not have been refused, later steps differ
            return
        self.has_ended[walker] = False

    def refuse_step(self, walker, actions):
        self.step(actions)

    def refuse(self, walker, what):
        """Makes a call that must raise."""
        actions = [[0.0] * self.action_size for _ in ALL]
        state = bytearray(self.save(walker)) if what == "state" else bytearray(1)
        state[-1] ^= 1
        try:
            if what == "action":
                actions[walker][0] = float("nan")
                self.refuse_step(walker, actions)
            elif what == "size":
                self.refuse_step(walker, [row[1:] for row in actions])
            elif what == "world":
                self.set_world(walker, {"wind": 1})
            elif what == "state":
                self.load(walker, bytes(state))
        except (ValueError, TypeError, RuntimeError):  # other tests check the exact types
            return
        raise AssertionError(f"{what} of walker {walker}: not refused")


class SingleWalkers(Interface):
    """Walkers that are called one by one, and reset when their episode has ended.

    A subclass has reset_one(walker, seed) and step_one(walker, action).
    """

    def reset(self, walkers, seed=None):
        for walker in walkers:
            self.reset_one(walker, None if seed is None else seed + walker)

    def step(self, actions):
        for walker in ALL:
            if not self.has_ended[walker]:
                self.step_one(walker, actions[walker])
                if not self.has_ended[walker]:
                    continue
            self.reset_one(walker, None)

    def refuse_step(self, walker, actions):
        self.step_one(walker, actions[walker])


def play(calls, case, interface):
    """Plays a script. Returns the trace."""
    states, num_steps = {}, 0
    for name, walkers, argument in calls:
        if name == "reset":
            interface.reset(walkers, int(argument) if argument else None)
        elif name == "step":
            for _ in range(int(argument)):
                num_steps += 1
                interface.prepare(num_steps)
                joints = range(interface.action_size)
                interface.step([[action_value(num_steps, i, j) for j in joints] for i in ALL])
        for walker in walkers:
            if name == "world":
                word, _, source = argument.partition(" ")
                world = interface.drawn[int(source)] if word == "drawn" else read_world(argument)
                interface.set_world(walker, case.level if argument == "level" else world)
            elif name == "set":
                interface.set_state(walker, num_steps)
            elif name == "save":
                states[argument] = interface.keep(walker, interface.save(walker))
            elif name == "load":
                interface.load(walker, states[argument])
                interface.has_ended[walker] = interface.saved[states[argument]]
            elif name == "refuse":
                interface.refuse(walker, argument)
    return interface.trace


def check(script, case, interface):
    """Compares an interface's trace with the oracle's."""
    expected = oracle(case.name, interface.resets_at_once)[script]
    trace = play(SCRIPTS[script], case, interface)
    for walker in ALL:
        lines = [interface.reported(line) for line in expected[walker]]
        for number, (line, other) in enumerate(zip(trace[walker], lines)):
            assert line == other, f"{script}, walker {walker}, line {number}:\n{line}\n{other}"
        assert len(trace[walker]) == len(lines), f"{script}, walker {walker}"
