"""Invalid arguments give a one-line error, status 2, and no output."""

import pytest

WALKER = "BipedalWalker-v3"
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
]


@pytest.mark.parametrize(("line", "message"), ERRORS)
def test_one_line_names_invalid_argument(command, line, message):
    ended = command(*line.split(), status=2)
    assert ended.out == ""
    assert message in ended.err


def test_error_names_missing_master(command, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", "http://localhost:1")
    error = command("evaluate", WALKER, "--transport", "ros", status=2).err
    assert "http://localhost:1" in error
