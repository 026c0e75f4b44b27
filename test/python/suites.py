"""Runs other projects' test suites, unchanged, with our environments under the ids that they make.

FOLDER holds the suite's tests/. It is a checkout of Gymnasium's repository, or the unpacked source
package of Stable-Baselines3. Tests that cannot pass are listed below with the reason and must fail.
"""

import argparse
import dataclasses
import os
import pathlib
import re
import sys

import gymnasium
import pytest
import walker_sim
import walker_sim.environment


@dataclasses.dataclass
class Suite:
    replaced: dict  # {Gymnasium's id: this package's id}
    files: list  # below tests/
    chosen: str  # regular expression for the names of the tests that make these ids
    failing: dict  # {test function: why it fails}
    count: int

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, config, items):
        chosen = [item for item in items if re.search(self.chosen, item.name)]
        if len(chosen) != self.count:
            raise pytest.UsageError(f"{len(chosen)} tests make our ids; must be {self.count}")
        config.hook.pytest_deselected(items=[item for item in items if item not in chosen])
        items[:] = chosen
        for item in items:
            reason = self.failing.get(item.originalname)
            if reason:
                item.add_marker(pytest.mark.xfail(reason=reason, strict=True))


OBJECTS = "uses Gymnasium's class or its engine's objects: isinstance, .model, .data"

SUITES = {
    "gymnasium": Suite(
        replaced={name.partition("/")[2]: name for name in walker_sim.ids()},
        files=[
            "envs/mujoco",
            *(f"envs/test_{name}.py" for name in ("action_dim_check", "env_implementation")),
            *("envs/test_envs.py", "envs/test_rendering.py"),
            *("vector/test_sync_vector_env.py", "wrappers/test_passive_env_checker.py"),
        ],
        chosen="BipedalWalker|Walker2d|Hopper|bipedal_walker",
        failing={
            "test_bipedal_walker_hardcore_creation": OBJECTS,
            "test_mujoco_action_dimensions": "asks for Gymnasium's error message",
            "test_observation_structure": OBJECTS,
            "test_reset_noise_scale": OBJECTS,
            "test_reset_state": OBJECTS,
            "test_verify_info_x_velocity": OBJECTS,
            "test_verify_reward_survive": OBJECTS,
            "test_z_distance_from_origin_info": OBJECTS,
        },
        count=99,
    ),
    "sb3": Suite(
        replaced={"Pendulum-v1": "walker_sim/BipedalWalker-v3"},
        files=["test_run.py", "test_predict.py", "test_vec_normalize.py"],
        # DQN does not support continuous actions; CUDA is not available; test_ppo_warnings needs a
        # positive loss, which Pendulum's large negative rewards cause, but a walker's not always.
        chosen=r"^(?!.*(cuda|DQN)).*Pendulum|^test_(deterministic_pg|n_critics|offpolicy_normalization|"
        r"sac|train_freq|offpolicy_multi_env\[(DDPG|SAC|TD3)|(sync_vec_normalize|vec_env)\[make_env)",
        failing={},
        count=35,
    ),
}


def replace(their_id, our_id):
    """Gives our entry point an alias in gymnasium.envs, where Gymnasium's tests look for it."""
    module = gymnasium.registry[their_id].entry_point.partition(":")[0] + ".walker_sim"
    sys.modules[module] = walker_sim.environment
    ours = gymnasium.registry[our_id]
    gymnasium.registry[their_id] = dataclasses.replace(
        ours, id=their_id, entry_point=f"{module}:WalkerEnv", kwargs=dict(ours.kwargs)
    )
    made = gymnasium.make(their_id).unwrapped
    assert type(made) is walker_sim.WalkerEnv
    made.close()


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("suite", choices=SUITES)
    parser.add_argument("folder", metavar="FOLDER")
    parsed, options = parser.parse_known_args()  # the other options are pytest's
    suite = SUITES[parsed.suite]
    os.chdir(parsed.folder)
    sys.path.insert(0, os.getcwd())  # Gymnasium's tests import each other from tests
    for their_id, our_id in suite.replaced.items():
        replace(their_id, our_id)
    files = [str(pathlib.Path("tests") / file) for file in suite.files]
    arguments = ["-q", "-p", "no:cacheprovider", "-W", "ignore", *options, *files]
    return pytest.main(arguments, plugins=[suite])


if __name__ == "__main__":
    sys.exit(main())
