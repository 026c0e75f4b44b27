"""rosnodejs, a ROS client in JavaScript, drives a server and receives Gymnasium's bits."""

import json
import os
import pathlib
import shutil
import subprocess

import numpy as np
from walkers import make_reference, random_actions

ROOT = pathlib.Path(__file__).resolve().parents[2]
STEPS = 1000
SEED = 7


def rows_of_gymnasium(actions):
    environment = make_reference("BipedalWalker-v3")
    rows = [[*environment.reset(seed=SEED)[0], 0, 0, 0]]
    for action in actions:
        observation, reward, terminated, truncated, _ = environment.step(action)
        rows.append([*observation, reward, terminated, truncated])
        if terminated or truncated:
            rows.append([*environment.reset()[0], 0, 0, 0])
    return np.array(rows, np.float64)


def test_a_thousand_steps_equal_gymnasiums(serve, tmp_path):
    """rosnodejs searches ROS_PACKAGE_PATH for message definitions, in folders with the package's
    name. Debian's are in /usr/share. `reuse_world` keeps the Box2D world, as Gymnasium does."""
    package = tmp_path / "packages" / "walker_sim"
    package.mkdir(parents=True)
    shutil.copy(ROOT / "package.xml", package)
    for folder in ("msg", "srv"):
        shutil.copytree(ROOT / folder, package / folder)
    actions = random_actions("BipedalWalker-v3", STEPS)
    server, _ = serve("BipedalWalker-v3", reuse_world="true")
    program = pathlib.Path(os.environ["WALKER_SIM_ROSNODEJS"]) / "lockstep.js"
    subprocess.run(
        ["node", program, server, str(SEED), tmp_path / "rows"],
        env={**os.environ, "ROS_PACKAGE_PATH": f"{package.parent}:/usr/share"},
        input=json.dumps(actions.tolist()).encode(),
        timeout=120,
        check=True,
    )
    expected = rows_of_gymnasium(actions)
    assert len(expected) > STEPS + 1, "no episode has ended"
    rows = np.fromfile(tmp_path / "rows").reshape(-1, expected.shape[1])
    assert rows.shape == expected.shape
    assert rows.tobytes() == expected.tobytes()
