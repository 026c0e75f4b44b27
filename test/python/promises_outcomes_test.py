"""Every way to play a policy's episodes gives the oracle's outcomes, to the bit."""

import functools
import json
import os
import subprocess

import numpy as np
import pytest
import walker_sim
from promises import CASES, hexadecimal, write_model
from walker_sim import _core, episode_player
from walker_sim.training.policy_file import PolicyFile, write_policy
from walker_sim.worlds import to_world

SEEDS = 5
POLICY = "policy.safetensors"
EFFECTS = "{gravity: [-11, -7], push_interval: [0.1, 0.3], action_delay: [0, 0.05], dropout: 0.1}"
WORLDS = ["gymnasium", EFFECTS, "level"]


def write_random_policy(env_id, keywords, path):
    """Writes a network that fits, of random numbers; its actions reach their limits at times."""
    specification = _core.Pool(env_id, keywords).specification
    sizes = [len(specification["observation_low"]), 16, len(specification["action_low"])]
    draws = np.random.default_rng(1)
    layers = [
        (draws.normal(0, 1, (rows, columns)), draws.normal(0, 1, rows))
        for columns, rows in zip(sizes, sizes[1:])
    ]
    low, high = np.array(specification["action_low"]), np.array(specification["action_high"])
    mean, deviation = draws.normal(0, 0.1, sizes[0]), np.ones(sizes[0])
    write_policy(PolicyFile(env_id, {}, "tanh", "clip", mean, deviation, low, high, layers), path)


def line_of(episode_return, length, terminated, truncated, info, error, world):
    """Returns the outcome as the oracle prints it; `info` and `world` are values by name."""
    flags = {"terminated": terminated, "truncated": truncated}
    line = f"{hexadecimal(episode_return)} {length}"
    line += "".join(f" {name}" for name, is_set in flags.items() if is_set)
    line += "".join(f" {name}={hexadecimal(value)}" for name, value in info.items())
    line += "".join(f" world {name}={hexadecimal(world[name])}" for name in sorted(world))
    return line + (f" failed: {error}" if error else "")


def play(case, keywords, policy, worlds):
    """All worlds at once, by the player of `play_out`."""
    player = episode_player.make_player(case.env_id, keywords, num_threads=2)
    ranges = [to_world(case.env_id, world) for world in worlds]
    jobs = [(0, seed, world) for world in range(len(worlds)) for seed in range(SEEDS)]
    network = _core.Policy(os.fsencode(policy))
    played = episode_player.play_jobs(player, [network], ranges, jobs)
    found = walker_sim.play_out(
        case.env_id, policy, range(SEEDS), worlds=worlds, num_threads=1, **keywords
    )
    assert found.returns.ravel().tolist() == [one.episode_return for one in played]
    return [
        line_of(
            *(one.episode_return, one.length, one.terminated, one.truncated),
            *(one.info, one.error, one.world),
        )
        for one in played
    ]


def to_text(value):
    return value if isinstance(value, str) else json.dumps(value)


def evaluate(command, words, case, keywords, policy, worlds):
    """One world after the other, by the command line."""
    lines = []
    file = policy.parent / "outcomes.json"
    parameters = [f"{name}={to_text(value)}" for name, value in keywords.items()]
    for world in worlds:
        given = "--episodes", SEEDS, "--world", to_text(world), "--json", file
        command("evaluate", case.env_id, *parameters, "--policy", policy, *given, *words)
        for one in json.loads(file.read_text())["outcomes"]:
            ends = one["terminated"], one["truncated"]
            given = one["info"], one["error"], one.get("world", {})
            lines.append(line_of(one["return"], one["length"], *ends, *given))
    return lines


FUNCTION = """
import os
import numpy as np
from walker_sim import _core
network = _core.Policy(os.fsencode({path!r}))
def act(observation):
    action = np.empty(network.action_size)
    network.act(observation.astype(np.float64), action)
    return action
"""


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("way", ["play_out", "evaluate", "evaluate_a_function"])
def test_outcomes(command, tmp_path, monkeypatch, way, case):
    play_all = play
    if way != "play_out":
        play_all = functools.partial(evaluate, command, ["--num-envs", 3])
    if way == "evaluate_a_function":
        path = str(tmp_path / POLICY)
        (tmp_path / f"acting_{case}.py").write_text(FUNCTION.format(path=path))
        monkeypatch.syspath_prepend(tmp_path)
        words = ["--num-envs", 3, "--policy", f"acting_{case}:act"]  # the last --policy counts
        play_all = functools.partial(evaluate, command, words)
    check(play_all, CASES[case], tmp_path)


@pytest.mark.parametrize("case", CASES)
def test_outcomes_over_ros(command, tmp_path, serve, case):
    keywords = write_model(CASES[case], tmp_path)
    name, _ = serve(env=CASES[case].env_id, num_envs=2, **keywords)
    words = ["--transport", "ros", "--server", name, "--num-envs", 2]
    check(functools.partial(evaluate, command, words), CASES[case], tmp_path)


def check(play_all, case, folder):
    keywords = write_model(case, folder)
    policy = folder / POLICY
    write_random_policy(case.env_id, keywords, policy)
    program = f"{os.environ['WALKER_SIM_PROGRAMS']}/walker_sim_oracle"
    words = [program, case.name, policy, str(SEEDS), *WORLDS]
    expected = subprocess.run(words, stdout=subprocess.PIPE, check=True).stdout.decode()
    worlds = [case.level if world == "level" else world for world in WORLDS]
    found = play_all(case, keywords, policy, worlds)
    assert found == expected.splitlines()
