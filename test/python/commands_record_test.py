"""record: the file equals Gymnasium's episodes, and --check detects any changed bit."""

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.box2d.bipedal_walker import BipedalWalkerHeuristics
from gymnasium_reference import equal_bits
from walker_sim import _core
from walkers import make_ours

WORLD = "{gravity: [-12, -8], push_interval: [1, 2], action_delay: 0.02}"
NUMBERS = ("observations", "actions", "rewards", "terminated", "truncated", "infos")


def test_file_has_gymnasiums_episodes(record):
    recorded, _ = record("BipedalWalker-v3", "--seeds", "8,3,1")
    assert recorded["seeds"].tolist() == [8, 3, 1]
    starts = recorded["episode_starts"]
    for index, seed in enumerate((8, 3, 1)):
        environment = gymnasium.make("BipedalWalker-v3")
        heuristic = BipedalWalkerHeuristics()
        observation, _ = environment.reset(seed=seed)
        observations, outcomes = [observation], []
        for action in recorded["actions"][starts[index] : starts[index + 1]]:
            assert equal_bits(heuristic.step_heuristic(observation), action)
            observation, *outcome, _ = environment.step(action)
            observations.append(observation)
            outcomes.append(outcome)
        steps = slice(starts[index], starts[index + 1])
        states = slice(starts[index] + index, starts[index + 1] + index + 1)
        assert equal_bits(recorded["observations"][states], observations)
        names = ("rewards", "terminated", "truncated")
        assert equal_bits(np.array([recorded[name][steps] for name in names]).T, outcomes)
        assert recorded["terminated"][steps][-1]


def test_file_describes_its_origin(record):
    options = ["--policy", "zero", "--episodes", "2", "ctrl_cost_weight=0.5"]
    recorded, _ = record("walker_sim/Walker2d-v5", *options)
    steps = len(recorded["actions"])
    assert recorded["observations"].shape == (steps + 2, 17)
    assert recorded["observations"].dtype == np.float64
    assert recorded["actions"].shape == (steps, 6)
    assert recorded["actions"].dtype == np.float32
    assert recorded["infos"].shape == (steps + 2, len(recorded["info_names"]))
    assert recorded["episode_starts"].tolist()[::2] == [0, steps]
    assert (str(recorded["id"]), str(recorded["policy"])) == ("Walker2d-v5", "zero")
    parameters = dict(zip(recorded["parameter_names"], recorded["parameter_values"]))
    assert parameters["ctrl_cost_weight"] == "0.5"
    assert str(recorded["engine_version"]).startswith("2.2.2")


def test_file_does_not_depend_on_num_envs(record):
    options = ["Walker2d-v4", "--policy", "random", "--episodes", "20"]
    one, _ = record(*options, "--num-envs", "1")
    many, _ = record(*options, "--num-envs", "16", "--num-threads", "3")
    assert one.keys() == many.keys()
    assert all(one[name].tobytes() == many[name].tobytes() for name in one)


@pytest.mark.parametrize(
    "arguments",
    [
        ["BipedalWalkerHardcore-v3", "--episodes", "4"],
        ["BipedalWalker-v3", "reuse_world=true", "--seeds", "1,3"],
        ["Walker2d-v5", "--policy", "random", "healthy_z_range=[0.5, .inf]"],
        ["BipedalWalker-v3", "--world", "hard", "--episodes", 4],
        ["BipedalWalker-v3", "--world", WORLD, "--episodes", 4],
        ["Walker2d-v5", "--policy", "random", "--world", "noisy", "--episodes", 4],
        ["Hopper-v4", "--world", "{gravity: [-12, -8], dropout: 0.5}", "--episodes", 6],
    ],
)
def test_check_repeats_every_episode(record, command, arguments):
    recorded, file = record(*arguments)
    count, steps = len(recorded["seeds"]), len(recorded["actions"])
    for num_envs in (1, 1 if "reuse_world=true" in arguments else 3):
        out = command("record", "--check", file, "--num-envs", num_envs).out
        assert out.count("  equal\n") == count
        assert out.endswith(f"{count} of {count} episodes equal to the bit ({steps:,} steps)\n")
    world = arguments[arguments.index("--world") + 1] if "--world" in arguments else None
    env = make_ours(arguments[0], world=world)
    for seed, text in zip(recorded["seeds"].tolist(), recorded["worlds"].tolist()):
        drawn = {name: low for name, (low, _) in _core.load_world(text or "{}").items()}
        assert env.reset(seed=seed)[1].get("world", {}) == drawn


@pytest.mark.parametrize("name", NUMBERS)
def test_check_detects_a_single_bit(record, command, name):
    recorded, file = record("Walker2d-v5", "--policy", "random", "--episodes", "3")
    row = recorded["episode_starts"][1] + 5 + (name in ("observations", "infos"))
    raw = recorded[name][row : row + 1].view(np.uint8)
    raw[..., 0] ^= 1
    np.savez(file, **recorded)
    out = command("record", "--check", file, status=1).out
    lines = out.splitlines()
    assert [line.endswith("  equal") for line in lines[1:4]] == [True, False, True]
    assert "differs at step " in lines[2]
    if name != "actions":  # a changed action changes the outcome
        step = 5 + (name not in ("observations", "infos"))
        assert f"differs at step {step}: {name}[0]" in out
    assert lines[-1].startswith("2 of 3 episodes equal (")


def test_check_refuses_levels_of_boxes(record, command):
    """Earlier releases made MuJoCo's levels of boxes."""
    words = ("--world", "walker2d_pits", "--episodes", "1", "max_episode_steps=5")
    recorded, file = record("Walker2d-v5", *words)
    np.savez(file, **{**recorded, "engine_version": "2.2.2 (pinned, mujoco 2.2.2)"})
    error = command("record", "--check", file, status=2).err
    assert "recorded in levels of boxes; must be of lines, as here" in error


def test_check_reports_another_c_library(record, command):
    recorded, file = record("Walker2d-v5", "--episodes", "1", "max_episode_steps=5")
    release, _, own = str(recorded["engine_version"]).partition(", libm: ")
    own = own.partition(",")[0]
    assert own
    for version, said in (
        (f"{release}, libm: another, stepped by hand", True),
        (release, False),  # written by a release without libm in its version
    ):
        np.savez(file, **{**recorded, "engine_version": version})
        out = command("record", "--check", file).out
        words = f"recorded with libm: another; repeated with libm: {own}: its sin, cos and pow "
        assert (words in out) == said
        assert ("libm" in out) == said
