"""Invalid arguments give a one-line error, status 2, and neither output nor files."""

import sys
from types import SimpleNamespace

import pytest
from walker_sim.commands.policies import shipped_policy

WALKER = "BipedalWalker-v3"
NETWORK = shipped_policy("Walker2d-v5")
IDS = "BipedalWalker-v3, BipedalWalkerHardcore-v3, Walker2d-v4, Walker2d-v5, Hopper-v4, Hopper-v5"
EVALUATE_ERRORS = [  # words after "evaluate BipedalWalker-v3"
    ("Walker2d-v4", "BipedalWalker-v3 Walker2d-v4: only one ID is allowed"),
    ("hard=1", "parameter hard = 1: unknown"),
    ("hardcore=1", "parameter hardcore = 1: must be true or false"),
    ("hardcore=true hardcore=true", "parameter hardcore: given twice"),
    ("hardcore=\udcfc", r"'hardcore=\udcfc': must be a text that UTF-8 can encode"),
    (
        "--policy walk",
        "--policy walk: must be heuristic, random, zero, shipped, robust, FILE.safetensors, ",
    ),
    ("--policy no_such:walk", "--policy no_such:walk: No module named 'no_such'"),
    ("--policy math:walk", "--policy math:walk: module 'math' has no attribute"),
    ("--policy math:pi", "--policy math:pi: must be a function or a class"),
    ("--policy none.safetensors", "--policy none.safetensors: it cannot be read as a file"),
    (f"--policy {NETWORK}", "made for Walker2d-v5: it takes 17 observations"),
    ("--policy no_such.zip", "--policy no_such.zip: not a model saved by Sta"),
    ("--seeds 5:5", "--seeds: 5:5: must be ascending"),
    ("--seeds 1,2,1", "--seeds: 1,2,1: must have seed 1 once"),
    ("--seeds 1;2", "--seeds: 1;2: must be comma-separated seeds"),
    ("--seeds 18446744073709551616", "with seeds from 0 to 2^64 - 1"),
    ("--seeds 0:1000001", "must be at most 1000000 episodes"),
    ("--seeds 1 --episodes 1", "--episodes: not allowed with argument --seeds"),
    ("--episodes 0", "--episodes: 0: must be a whole number above 0"),
    ("--num-envs 1.5", "--num-envs: 1.5: must be a whole number above 0"),
    ("--num-threads 5000", "num_threads = 5000: must be in [0, 1024]"),
    ("--threshold high", "--threshold: high: must be a number"),
    ("--csv /no/such/folder/file", "--csv: /no/such/folder/file: must be a file"),
    ("--transport carrier", "invalid choice: 'carrier'"),
    ("--transport ros --num-threads 2", "over ROS it is the server's parameter"),
    ("reuse_world=true --num-envs 2", "must be 1 with reuse_world=true"),
    ("--plot returns.xyz", "--plot returns.xyz: must end in ."),
    ("--grid push_impulse", "push_impulse: must be NAME=FIRST:END:STEP or NAME=VALUE"),
    ("--grid gravity=", "gravity=: must be NAME="),
    ("--grid gravity=-9:-7", "gravity=-9:-7: must be NAME="),
    ("--grid gravity=nan", "gravity=nan: must be NAME="),
    ("--grid gravity=1,,2", "gravity=1,,2: must be NAME="),
    ("--grid gravity=-7:-9:1", "gravity=-7:-9:1: must ascend from FIRST to END"),
    ("--grid gravity=-9:-7:0", "with STEP above 0"),
    ("--grid gravity=-9:-7:1e-99999999", "with STEP above 0"),
    ("--grid gravity=-9:-7:1e-9", "must be at most 1000 values"),
    ("--grid gravity=-11:-9:0.7", "whole steps from FIRST to END; END may be -9.6 or -8.9"),
    (
        "--grid gravity=0:1:0.3333333333333333",
        "END may be 0.9999999999999999 or 1.3333333333333333",
    ),
    ("--grid gravity=-9:1e999:1", "must have numbers below 1.8e+308"),
    ("--grid gravity=-9:1e99999999999999999999:1", "must have numbers below 1.8e+308"),
    ("--grid gravity=-1e308:1e308:1e-300", "must be at most 1000 values"),
    ("--grid gravity=-9:-7:1e-99999999999999999999", "with STEP above 0"),
    ("--grid gravity=-9,-8,-9.0", "must have the value -9 once"),
    (
        "--grid action_delay=0.02,0.021",
        "action_delay=0.021: must be another world than action_delay=0.02; delays and "
        "intervals are rounded to steps of 0.02 s",
    ),
    ("--policy shipped --grid push_interval=0.1,0.107", "rounded to steps of 0.02 s"),
    ("--world moon {gravity:-1.62}", "{gravity:-1.62}: must be another world than moon"),
    ("--grid gravity=-1e999", "gravity = -.inf: must be finite, in [-30.0, 0.0]"),
    ("--grid gravity=-9 --grid gravity=-8", "--grid gravity: given twice"),
    (
        "--grid gravity=1 --grid dropout=0 --grid friction_scale=1 --grid hull_mass=5",
        "at most 3 times",
    ),
    (
        "--grid gravity=-1 --grid dropout=0 --grid friction_scale=1 --plot grid.png",
        "at most two --grid, not 3",
    ),
    ("--grid gravity=-31:-29:1", "gravity = -31.0: must be in [-30.0, 0.0] m/s^2"),
    ("--grid gravty=1", "world parameter gravty = 1.0: unknown"),
    ("--grid stair_steps=1.5", "stair_steps = 1.5: must be a whole number"),
    ("--grid obstacle_spacing=1,2", "obstacle_spacing"),
    ("--grid push_impulse=10,61", "push_impulse = 61.0: must be in [0.0, 60.0] N s"),
    ("--grid action_delay=0.001", "action_delay = 0.001 s: is shorter than half a step"),
    ("--policy shipped --grid action_delay=0.001", "is shorter than half a step"),
    ("--world moon moon", "--world moon: given twice"),
    ("--world moon mars", "world mars, neither a preset nor a readable YAML file"),
    ("--world moon mars --grid gravity=-9", "world mars, neither a preset"),
    ("--world moon BipedalWalker-v9", "world BipedalWalker-v9, neither a preset nor"),
    ("--grid gravity=-9:-1:1 --episodes 111112", "1,111,120 episodes"),
    ("--grid gravity=-9 reuse_world=true", "reuse_world=true: must be false with several"),
    ("--worst 1 reuse_world=true", "reuse_world=true: must be false with --worst"),
    (f"--num-threads 1{18 * '0'}", "0: must be below 10^18"),
    (f"--episodes {'9' * 5000}", "9: must be below 10^18"),
    (f"--seeds 0:{'9' * 5000}", "9: must be ascending, with seeds from 0 to 2^64 - 1"),
    ("--episodes 1000001", "--episodes: 1000001: must be at most 1000000 episodes"),
    ("--worst 0", "--worst: 0: must be a whole number above 0"),
    ("--grid gravity=-9 --plot grid.xyz", "--plot grid.xyz: must end in ."),
    (
        "--grid gravity=-9.99:0:0.01 --grid dropout=0.001:1:0.001 --episodes 1",
        "1,000,001 episodes, 1 in each world",
    ),
    *(
        (
            f"--policy {policy} --normalization my.pkl",
            "--normalization my.pkl: only for --policy FILE.zip",
        )
        for policy in ("shipped", "heuristic", "my.safetensors", "math:sin")
    ),
]
ERRORS = [
    *((f"evaluate {WALKER} {words}", message) for words, message in EVALUATE_ERRORS),
    ("", "the following arguments are required: COMMAND"),
    ("fly", "invalid choice: 'fly'"),
    ("evaluate", f"ID is missing; must be one of {IDS}"),
    ("evaluate Ant-v5", f"ID = Ant-v5: must be one of {IDS}"),
    ("evaluate Walker2d-v5 frame_skip=0", "parameter frame_skip = 0: must be an integer in"),
    ("evaluate Walker2d-v5 frame_skip=two", "parameter frame_skip = two: must be"),
    (
        "evaluate Walker2d-v5 exclude_current_positions_from_observation=false",
        "--policy heuristic: agent = heuristic: needs Walker2d-v5 with exclude_current_positions",
    ),
    (f"record {WALKER}", "one of the arguments --output --minari --check is required"),
    (f"record {WALKER} --output walk.zip", "--output walk.zip: must end in .npz"),
    (f"record {WALKER} --check walk.npz", "--check walk.npz: not allowed with walker"),
    ("record --check /no/such.npz", "No such file or directory: '/no/such.npz'"),
    (f"train {WALKER} --seed x", "--seed: x: must be a whole number from 0"),
    (f"train {WALKER} --steps 0", "--steps: 0: must be a whole number above 0"),
    (f"bench {WALKER} --seconds 0", "--seconds: 0: must be a number above 0"),
    (f"bench {WALKER} --num-envs 1,x", "--num-envs: x: must be a whole number above 0"),
    (f"bench {WALKER} --num-envs 1048577", "num_envs = 1048577: must be in [1, 1048576]"),
    ("hash Walker3d", "ID = Walker3d: must be one of"),
    ("hash Walker2d-v5 ctrl_cost_weight=1", "ctrl_cost_weight=1: parameters cannot be set"),
    ("hash --steps 0", "--steps: 0: must be a whole number above 0"),
    ("play Ant-v4", "Ant-v4: must be one of"),
    ("play --speed 0", "0: must be a number above 0"),
    ("play --speed 100", "--speed 100: must be between 0.015625 and 64"),
    ("play --policy smoke", "--policy smoke: must be heuristic"),
    ("play width=0", "width = 0: must be"),
    ("play zoom=2", "zoom"),
    (
        "evaluate Hopper-v5 --policy shipped --world {action_delay:0.001}",
        "shorter than half a step",
    ),
    *(
        (f"{words} Hopper-v5 --world {world}", message)
        for words in ("evaluate", "play", "record --output a.npz")
        for world, message in (
            ("mon", "neither a preset nor a readable YAML file: unknown; did you mean moon?"),
            ("hard", "stump_height = [0.95, 1.4]: must be in [0.02, 1.0] m"),
            ("{push_impulse:1}", "world parameter push_impulse = 1.0: has no effect without"),
        )
    ),
    ("record --check a.npz --world moon", "not allowed with world"),
    *((f"{name} Hopper-v5 --world moon", "--world") for name in ("bench", "hash", "convert")),
    ("worlds moon", "ID = moon: must be one of"),
    (f"evaluate {WALKER} --transport ros", "http://localhost:1"),
    ("doctor all", "unrecognized arguments: all"),
]


@pytest.mark.parametrize(("line", "message"), ERRORS)
def test_one_line_names_invalid_argument(command, line, message, monkeypatch, tmp_path):
    monkeypatch.setenv("ROS_MASTER_URI", "http://localhost:1")  # no master is there
    monkeypatch.chdir(tmp_path)
    ended = command(*line.split(), status=2)
    assert ended.out == ""
    assert message in ended.err
    assert [*tmp_path.iterdir()] == []


MINARI = ("minari", "h5py", "PIL")
OF_MINARI = (
    "record Hopper-v5 --minari hop/gait-v0",
    "needs Minari: pip install 'minari[hdf5]' pillow (",
)


@pytest.mark.parametrize(
    ("package", "line", "message"),
    [
        *((package, *OF_MINARI) for package in MINARI),
        ("onnx", f"convert {NETWORK} policy.onnx", ".safetensors: needs onnx: pip install onnx"),
        ("pygame", "play", 'needs pygame: pip install "walker_sim[window]"'),
    ],
)
def test_error_names_missing_package(command, monkeypatch, tmp_path, package, line, message):
    monkeypatch.chdir(tmp_path)
    for each in MINARI if package in MINARI else ():
        monkeypatch.setitem(sys.modules, each, SimpleNamespace())
    monkeypatch.setitem(sys.modules, package, None)
    error = command(*line.split(), status=2).err
    assert message in error
    assert package in error
    assert [*tmp_path.iterdir()] == []
