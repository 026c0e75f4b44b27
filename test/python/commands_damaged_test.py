"""Damaged input files of the commands: a one-line error, status 2, never a traceback.

The damage is drawn from a fixed seed: flipped bits, overwritten bytes, deleted parts, truncation.
"""

import io
import os
import struct
import zipfile

import numpy as np
import pytest
from walker_sim.commands import main
from walker_sim.files import package_file

TRIALS = 150
POLICY = package_file("assets/policies/Hopper-v5.safetensors").read_bytes()
HEADER_END = 8 + struct.unpack_from("<Q", POLICY)[0]
EVALUATE = ("evaluate", "Hopper-v5", "--seeds", "1", "max_episode_steps=5", "--policy")


def damaged(whole, random):
    content = bytearray(whole)
    kind = random.integers(5)
    begin = int(random.integers(len(content)))
    if kind == 0:
        del content[begin:]
    elif kind == 1:
        del content[begin : begin + int(random.integers(1, 64))]
    elif kind == 2:
        content[begin : begin + 8] = struct.pack("<Q", random.integers(1 << 63))
    elif kind == 3:
        content[begin : begin + 4] = b"\xff" * 4
    else:
        for other in random.integers(len(content), size=random.integers(1, 4)):
            content[other] ^= 1 << random.integers(8)
    return bytes(content)


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Small recordings, as written and uncompressed, where damage reaches the arrays."""
    folder = tmp_path_factory.mktemp("recordings")
    files = []
    for name, policy in (("BipedalWalker-v3", "heuristic"), ("Walker2d-v5", "random")):
        file = folder / f"{name}.npz"
        arguments = (name, "--policy", policy, "--seeds", "3,4", "max_episode_steps=6")
        assert main(["record", *arguments, "--output", str(file)]) == 0
        files.append(file)
        with np.load(file) as arrays:
            plain = folder / f"plain_{name}.npz"
            np.savez(plain, **arrays)
            files.append(plain)
    return [file.read_bytes() for file in files]


@pytest.mark.parametrize("index", range(4))
def test_damaged_recording(recordings, index, tmp_path, command):
    random = np.random.default_rng(index)
    file = tmp_path / "walk.npz"
    statuses = []
    for _ in range(TRIALS):
        file.write_bytes(damaged(recordings[index], random))
        ended = command("record", "--check", file, status=None)
        statuses.append(ended.status)
        assert ended.status != 2 or str(file) in ended.err
    assert statuses.count(2) > TRIALS / 3


@pytest.fixture
def arrays(recordings):
    with np.load(io.BytesIO(recordings[3])) as loaded:
        return dict(loaded)


def changed(arrays, random):
    name = sorted(arrays)[random.integers(len(arrays))]
    array = arrays[name]
    choices = [
        lambda: np.array([array, array]),
        lambda: array.reshape(-1)[:0],
        lambda: np.array(7),
        lambda: np.array("text"),
        lambda: np.array([1.5, float("nan")]),
        lambda: np.full_like(array, 0),
        lambda: array.astype("f2") if array.dtype.kind in "fiub" else array.astype("S"),
        lambda: np.zeros(array.shape, [("a", "f8")]),
        lambda: np.full((3, 2, 1), 1 << 62),
        lambda: np.array("Walker2d-v5\ud800"),
        lambda: np.array(["\n\x1b[2J", "a=b"]),
    ]
    return {**arrays, name: choices[random.integers(len(choices))]()}


def test_recording_with_changed_arrays(arrays, tmp_path, command):
    random = np.random.default_rng(9)
    file = tmp_path / "walk.npz"
    statuses = []
    for _ in range(2 * TRIALS):
        np.savez(file, **changed(arrays, random))
        statuses.append(command("record", "--check", file, status=None).status)
    assert statuses.count(2) > TRIALS


def pushes(steps, columns=2, force=1.0):
    forces = np.full((len(steps), columns), force)
    return {"format": 2, "push_steps": np.array(steps), "push_forces": forces}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"actions": np.zeros((12, 3), np.float32)}, "actions have 3 values; must have 6"),
        ({"actions": np.full((12, 6), np.nan, np.float32)}, "actions must be finite"),
        (
            {"actions": np.zeros((12, 6))},
            "actions has 2 dimensions and type float64; must have 2 and",
        ),
        ({"rewards": np.zeros(11)}, "rewards has 11 rows; must have 12, one for each of its steps"),
        (
            {"infos": np.zeros((12, 0))},
            "infos has 12 rows; must have 14, one for each of its states",
        ),
        ({"episode_starts": np.array([0, 13, 12])}, "episode_starts must be ascending"),
        ({"episode_starts": np.array([-1, 6, 12])}, "episode_starts does not fit 2 seeds"),
        ({"format": 3}, "a recording of format 3; must be of format 1 or 2"),
        ({"format": 2}, "a recording without push_forces, push_steps"),
        (pushes([12]), "push_steps must be ascending, from 0 to 11"),
        (pushes([3, 3]), "push_steps must be ascending, from 0 to 11"),
        (pushes([3], columns=3), "push_forces must have two columns, the forces along x and z"),
        (pushes([3], force=np.inf), "push_forces must be finite"),
        ({"id": "Walker3d"}, "ID = Walker3d: must be one of"),
        ({"actions": None}, "a recording without actions"),
        ({"seeds": np.array([1.5, 2])}, "seeds has 1 dimensions and type float64; must have 1 and"),
        ({"parameter_values": np.array(["1"])}, "parameter_names does not fit parameter_values"),
        ({"worlds": np.array(["moon"])}, "worlds has 1 rows; must have 2"),
        *(
            ({"worlds": np.array(["", world])}, words)
            for world, words in (
                (
                    "{gravity: -1000}",
                    "world parameter gravity = -1000.0: must be in [-50.0, 0.0] m",
                ),
                (
                    "{gravity",
                    "world of the recording: {gravity: must be NAME: NUMBER, NAME: [LOW",
                ),
                ("moon", "world of the recording: moon: must be NAME: NUMBER, NAME: [LOW, HIGH]"),
                ("/dev/stdin", "world of the recording: /dev/stdin: must be NAME: NUMBER"),
                (
                    "{hip_speed: 1}",
                    "world parameter hip_speed = 1.0: cannot be applied by Walker2d",
                ),
            )
        ),
    ],
)
def test_error_names_inconsistent_array(arrays, tmp_path, command, change, message):
    file = tmp_path / "walk.npz"
    arrays = {name: array for name, array in {**arrays, **change}.items() if array is not None}
    np.savez(file, **arrays)
    assert f"{file}: {message}" in command("record", "--check", file, status=2).err


def test_error_names_other_file(tmp_path, command):
    pipe = tmp_path / "pipe.npz"
    os.mkfifo(pipe)
    cases = [(pipe, "must be a regular file"), (tmp_path, "must be a regular file")]
    for number, content in enumerate((b"", b"PK\x03\x04", b"no recording")):
        cases.append((tmp_path / f"{number}.npz", "not a recording: "))
        cases[-1][0].write_bytes(content)
    for path, message in cases:
        assert f"{path}: {message}" in command("record", "--check", path, status=2).err


def test_error_names_deeply_nested_json(tmp_path, command):
    nested = b'{"__metadata__":' + b"[" * 100_000
    policy, model = tmp_path / "policy.safetensors", tmp_path / "model.zip"
    policy.write_bytes(struct.pack("<Q", len(nested)) + nested)
    with zipfile.ZipFile(model, "w") as archive:
        archive.writestr("data", nested)
    for file, words in ((policy, "its header has no {"), (model, "recursion depth")):
        error = command(*EVALUATE, file, status=2).err
        assert str(file) in error
        assert words in error


def test_error_names_policy_whose_weights_overflow(tmp_path, command):
    weights = np.frombuffer(POLICY[HEADER_END:], np.float32).copy()
    weights[len(weights) // 4 :] = 3e38
    weights[len(weights) // 2 :] = -3e38
    file = tmp_path / "policy.safetensors"
    file.write_bytes(POLICY[:HEADER_END] + weights.tobytes())
    error = command(*EVALUATE, file, status=1).err
    assert "must be finite" in error
    assert error.count("\n") == 1


def test_file_name_need_not_be_utf8(command, tmp_path):
    file = tmp_path / "\udcff.safetensors"
    command(*EVALUATE, file, status=2)
    file.write_bytes(POLICY)
    command(*EVALUATE, file)


@pytest.mark.parametrize("text", ["7_0", "\u0667", "nan(1)", "inf\n", "9" * 5000], ids=range(5))
def test_rejects_numbers_that_other_parsers_take(command, text):
    for name in ("frame_skip", "healthy_reward", "healthy_z_range"):
        value = f"[{text},2]" if name == "healthy_z_range" else text
        error = command("evaluate", "Walker2d-v5", f"{name}={value}", status=2).err
        assert f"parameter {name} = " in error
