"""Compares every bit of a pool's steps with those of the installed Gymnasium's SyncVectorEnv.

Gymnasium keeps the Box2D world between episodes, so the pool does here (`reuse_world`).
"""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium_reference import equal_bits
from rollout_tool import PoolRollout, Refused

ENVIRONMENT_ID = "BipedalWalker-v3"
MAX_EPISODE_STEPS = 90  # some walkers fall earlier, some do not
NUM_ENVS = 5
NUM_STEPS = 400
UNTOUCHED = -12345.0  # PoolRollout's value for numbers not written
MODES = ["next_step", "same_step", "disabled"]


@pytest.fixture()
def pool():
    tool = PoolRollout()
    yield tool
    tool.close()


class Reference:
    """A SyncVectorEnv that returns PoolRollout's rows, with counters of its own."""

    def __init__(self, mode):
        self._mode = AutoresetMode[mode.upper()]
        self._vector = SyncVectorEnv([self._make] * NUM_ENVS, autoreset_mode=self._mode)
        self._episodes = np.zeros(NUM_ENVS)
        self._steps = np.zeros(NUM_ENVS)
        self.ended = np.zeros(NUM_ENVS, bool)
        self.num_terminated = self.num_truncated = 0

    @staticmethod
    def _make():
        return gymnasium.make(ENVIRONMENT_ID, max_episode_steps=MAX_EPISODE_STEPS)

    def reset(self, seeds):
        mask = np.isin(np.arange(NUM_ENVS), list(seeds))
        observations, infos = self._vector.reset(
            seed=[seeds.get(i) for i in range(NUM_ENVS)], options={"reset_mask": mask}
        )
        assert infos == {}
        self.ended[mask] = False
        self._begin(mask)
        rows = self._rows(observations, np.zeros((3, NUM_ENVS)))
        rows[~mask] = UNTOUCHED
        return rows

    def step(self, actions):
        due = self.ended & (self._mode == AutoresetMode.NEXT_STEP)
        observations, *outcome, infos = self._vector.step(actions)
        self.ended = outcome[1] | outcome[2]
        self.num_terminated += outcome[1].sum()
        self.num_truncated += outcome[2].sum()
        self._steps += 1
        self._begin(due)
        if self._mode == AutoresetMode.SAME_STEP:
            self._begin(self.ended)
        return self._rows(observations, outcome, infos)

    def _begin(self, mask):
        self._episodes[mask] += 1
        self._steps[mask] = 0

    def _rows(self, observations, outcome, infos=None):
        finals = np.full(observations.shape, UNTOUCHED)
        for i in np.flatnonzero((infos or {}).get("_final_obs", [])):
            finals[i] = infos["final_obs"][i]
        columns = [*outcome, self._episodes, self._steps, *observations.T, *finals.T]
        return np.array(columns, np.float64).T


def assert_equal(ours, theirs, when):
    for i in range(NUM_ENVS):
        if (theirs[i] == UNTOUCHED).all():  # PoolRollout's counters are 999 and its flags 9
            assert (ours[i, 5:] == UNTOUCHED).all(), (when, i)
        else:
            assert equal_bits(ours[i], theirs[i]), (when, i, ours[i], theirs[i])


def compare(pool, mode, num_threads, step):
    reference = Reference(mode)
    pool.make(
        *(ENVIRONMENT_ID, mode, NUM_ENVS, num_threads),
        max_episode_steps=MAX_EPISODE_STEPS,
        reuse_world=True,
    )
    random = np.random.default_rng(5)
    seeds = {i: 100 + i for i in range(NUM_ENVS)}
    assert_equal(pool.reset(seeds), reference.reset(seeds), "reset")
    for number in range(NUM_STEPS):
        resets = {}
        if mode == "disabled":
            resets = {i: None for i in np.flatnonzero(reference.ended)}
        if number % 100 == 50:  # resets two amid their episodes, one of them with a seed
            resets.update({1: None, 3: number})
        if resets:
            assert_equal(pool.reset(resets), reference.reset(resets), (number, resets))
        actions = random.uniform(-1.5, 1.5, (NUM_ENVS, 4)).astype(np.float32)
        assert_equal(step(actions), reference.step(actions), number)
    return reference


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("num_threads", [1, 3])
def test_steps_equal_gymnasium(pool, mode, num_threads):
    reference = compare(pool, mode, num_threads, pool.step)
    assert reference.num_terminated > 5 and reference.num_truncated > 5


@pytest.mark.parametrize("mode", MODES)
def test_send_and_recv_equal_gymnasium(pool, mode):
    compare(pool, mode, 2, pool.send_and_receive)


def test_disabled_refuses_steps_after_the_end(pool):
    reference = Reference("disabled")
    pool.make(ENVIRONMENT_ID, "disabled", NUM_ENVS, 2, max_episode_steps=MAX_EPISODE_STEPS)
    seeds = dict.fromkeys(range(NUM_ENVS), 2)
    reference.reset(seeds)
    pool.reset(seeds)
    actions = np.zeros((NUM_ENVS, 4), np.float32)
    while not reference.ended.any():
        reference.step(actions)
        pool.step(actions)
    with pytest.raises(AssertionError):
        reference.step(actions)
    with pytest.raises(
        Refused, match=r"^environment 0: the episode ended after [0-9]+ steps; reset first"
    ):
        pool.step(actions)
