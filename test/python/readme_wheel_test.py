"""README's first example and its walker without ROS, run unchanged.

stage.sh runs this in a new virtual environment, which README's pip command has filled.
"""

import os
import pathlib
import re
import subprocess
import sys
import urllib.request

import numpy as np
import walker_sim

ROOT = pathlib.Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMAND = "pip install 'walker_sim[box2d]'"
SENTENCE = f"or after `pip install .` and `{COMMAND}`, `python compare.py`)"


def block(language, words):
    blocks = re.findall(r"^```(\w*)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
    (found,) = [text for its, text in blocks if its == language and words in text]
    return found


def run(command, folder):
    path = os.pathsep.join([os.path.join(sys.prefix, "bin"), os.environ["PATH"]])
    return subprocess.run(
        command,
        shell=True,
        cwd=folder,
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        check=False,
    )


def test_the_first_example(tmp_path):
    assert pathlib.Path(sys.prefix) in pathlib.Path(walker_sim.__file__).parents
    assert SENTENCE in " ".join(README.split())
    (tmp_path / "compare.py").write_text(block("python", "for name in"), encoding="utf-8")
    done = run("python compare.py", tmp_path)
    assert done.returncode == 0, done.stderr
    expected = block("", "208 steps")
    if np.lib.NumpyVersion(np.__version__) >= "2.0.0":
        assert done.stdout == expected
        return
    # Under NumPy 1, Gymnasium computes the action's cost in double precision (docs/fidelity.md).
    theirs, ours = done.stdout.splitlines()
    assert ours == expected.splitlines()[1]
    returns = [float(re.search(r"return (\S+),", line)[1]) for line in (theirs, ours)]
    assert 0 < abs(returns[0] - returns[1]) < 1e-5
    assert theirs.replace(str(returns[0]), "") == expected.splitlines()[0].replace(
        str(returns[1]), ""
    )


def test_the_policy_walks(tmp_path):
    command = block("", "python3 -m walker_sim play").splitlines()[1]
    command = command.replace(" play ", " evaluate ").replace(" --web", "")
    done = run(f"{command} --seeds 0:5", tmp_path)
    assert done.returncode == 0, done.stderr
    assert float(re.search(r"mean return +(-?[\d.]+)", done.stdout)[1]) > 290, done.stdout


def test_the_page_is_served():
    """web_test.py uses it in a browser."""
    install, command = block("", "python3 -m walker_sim play").splitlines()
    assert install == "pip install '.[web]'"
    words = [sys.executable, *command.split()[1:]]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            address = re.search(r"http://127\.0\.0\.1:\S+", process.stdout.readline())[0]
            with urllib.request.urlopen(address, timeout=30) as answer:
                assert "<html" in answer.read().decode()
        finally:
            process.terminate()


def test_install_md_names_the_requirements():
    page = (ROOT / "docs/install.md").read_text(encoding="utf-8")
    assert "'.[box2d]'" in page
    assert "no compiler" in page
