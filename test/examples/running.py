"""Runs the examples as a user does, for their tests."""

import contextlib
import os
import pathlib
import re
import subprocess
import sys
import tempfile

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples"
PATIENCE = 600  # sufficient on two busy cores [s]


def start_example(name, *arguments, folder, **environment):
    return subprocess.Popen(
        [sys.executable, EXAMPLES / f"{name}.py", *map(str, arguments)],
        cwd=folder,
        env={**os.environ, **environment},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
    )


def run_example(name, *arguments, folder, status=0, **environment):
    with start_example(name, *arguments, folder=folder, **environment) as process:
        try:
            text, _ = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            raise
    assert process.returncode == status, text
    return text


def assert_helps(name, folder):
    text = run_example(name, "--help", folder=folder)
    assert f"python3 {name}.py" in text
    assert "--seed SEED" in text
    assert "What to expect of BipedalWalker-v3: " in text


class Arguments:
    """Tests of an example that trains; a subclass has its name, sizes and least --steps."""

    def test_help(self, tmp_path):
        assert_helps(self.name, tmp_path)

    def test_too_few_steps(self, tmp_path):
        few, least = self.least - 1, f"must be at least {self.least},"
        for words, reason in (
            (("--num-envs", 0), "--num-envs 0: must be at least "),
            (("--rollout", 0), "--rollout 0: must be at least "),
            ((*self.sizes, "--steps", few), f"--steps {few}: trains nothing; {least}"),
        ):
            assert reason in run_example(self.name, *words, folder=tmp_path, status=2)
        assert not list(tmp_path.iterdir())


def means_of_returns(text):
    """Parses the printed mean returns, keyed by the number of steps."""
    lines = re.findall(r"^(\d+) steps, mean of the last .*returns (-?\d+\.\d),", text, re.MULTILINE)
    return {int(steps): float(mean) for steps, mean in lines}


@contextlib.contextmanager
def short_folder():
    """A folder for Ray's sockets, whose paths may have at most 107 bytes."""
    with tempfile.TemporaryDirectory(prefix="ray_", dir="/tmp") as folder:
        yield pathlib.Path(folder)


def ray_home(folder):
    return {"HOME": str(folder), "RAY_TMPDIR": str(folder)}


def learn(name, *arguments, folder, **environment):
    """Runs an example that saves walker.pt. Returns its output and the saved tensors by name."""
    import torch

    text = run_example(name, *arguments, folder=folder, **environment)
    return text, torch.load(folder / "walker.pt")


def equal(one, other):
    """Returns whether tensors by name are equal."""
    assert one.keys() == other.keys()
    return all(one[name].equal(other[name]) for name in one)
