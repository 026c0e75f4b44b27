"""Rendering after a fork. OpenGL's threads do not exist in the child if the parent has rendered."""

import subprocess
import sys

FORKED = """
import os, sys
import gymnasium, numpy as np
import walker_sim

def make():
    env = gymnasium.make("walker_sim/{env_id}", render_mode="rgb_array")
    env.reset(seed=1)
    return env

def outcome_of(env):
    try:
        return env.render().shape[2]
    except RuntimeError as error:
        return str(error)

def in_child(call):
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        print(call())
        sys.exit(0)  # with all that an interpreter's end does
    assert os.waitpid(child, 0)[1] == 0

env = make()
"""
REFUSAL = "the parent process had drawn a picture before it forked this one"


def lines(calls, env_id="Walker2d-v5"):
    program = FORKED.format(env_id=env_id) + calls
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", program],
        stdout=subprocess.PIPE,
        text=True,
        timeout=240,
        check=True,
    )
    return done.stdout.splitlines()


def test_a_child_draws_if_its_parent_has_not():
    assert lines("in_child(lambda: outcome_of(env))\nprint(outcome_of(env))") == ["3", "3"]


def test_a_child_is_refused_if_its_parent_has_drawn():
    """Both the inherited and a new renderer refuse; the parent can still render."""
    calls = """
outcome_of(env)
in_child(lambda: outcome_of(env))
in_child(lambda: outcome_of(make()))
print(outcome_of(env))
"""
    seen = lines(calls)
    assert [line.startswith(REFUSAL) for line in seen] == [True, True, False], seen
    assert seen[-1] == "3"


def test_steps_and_cairos_pictures_work_after_a_fork():
    calls = """
outcome_of(env)
in_child(lambda: env.step(np.zeros(env.action_space.shape))[0].shape)
in_child(lambda: outcome_of(env))
"""
    assert lines(calls, "BipedalWalker-v3") == ["(24,)", "3"]
    assert lines(calls)[0] == "(17,)"


def test_async_vector_env_reports_the_refusal():
    calls = """
outcome_of(env)
envs = gymnasium.vector.AsyncVectorEnv([make] * 2, context="fork", shared_memory=False)
gymnasium.logger.min_level = 50
try:
    envs.call("render")
except RuntimeError as error:
    print(error)
envs.close(terminate=True)
"""
    assert lines(calls)[-1].startswith(REFUSAL)
