"""Zero-copy exchange of PyTorch tensors, with the same bits as NumPy arrays.

Runs with the distribution's PyTorch. The package itself never imports it.
"""

import re

import numpy as np
import pytest
import torch
import walker_sim
from gymnasium.wrappers import NumpyToTorch
from gymnasium.wrappers import vector as vector_wrappers
from walker_sim.arguments import to_action, to_actions
from walkers import follow, make_many, make_ours, random_actions, run_python

NUM_ENVS = 6
IDS = ["BipedalWalker-v3", "Walker2d-v5", "Hopper-v5"]


def make_vector(environment_id, **options):
    options = {"max_episode_steps": 20, **options}
    return make_many(environment_id, NUM_ENVS, **options)


class OnlyDlpack:
    def __init__(self, tensor):
        self._tensor = tensor

    def __dlpack__(self, **keywords):
        return self._tensor.__dlpack__(**keywords)

    def __dlpack_device__(self):
        return self._tensor.__dlpack_device__()


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize("form", [lambda tensor: tensor, OnlyDlpack, lambda t: t.numpy()])
def test_contiguous_actions_are_not_copied(dtype, form):
    one, many = torch.rand(4, dtype=dtype), torch.rand(NUM_ENVS, 4, dtype=dtype)
    assert to_action(form(one), (4,)).ctypes.data == one.data_ptr()
    assert to_actions(form(many), NUM_ENVS, 4).ctypes.data == many.data_ptr()


def test_other_actions_are_copied():
    turned = torch.rand(4, NUM_ENVS).T
    actions = to_actions(turned, NUM_ENVS, 4)
    assert actions.flags.c_contiguous and np.array_equal(actions, turned.numpy())
    assert to_action(torch.ones(4, dtype=torch.int32), (4,)).dtype == np.float64


def test_results_become_tensors_without_a_copy():
    envs = make_vector("Walker2d-v5")
    observations, _ = envs.reset(seed=1)
    results = [observations]
    for _ in range(3):
        results += envs.step(torch.zeros(NUM_ENVS, 6))[:4]
    single = make_ours("BipedalWalker-v3")
    results += [single.reset(seed=1)[0], single.step(torch.zeros(4))[0]]
    for result in results:
        assert result.flags.writeable and result.flags.c_contiguous
        assert torch.from_numpy(result).data_ptr() == result.ctypes.data
        if result.dtype != bool:  # this PyTorch does not support bool in DLPack
            tensor = torch.from_dlpack(result)
            assert tensor.data_ptr() == result.ctypes.data
            kept = tensor.clone()
            tensor += 1
            assert np.array_equal(result, (kept + 1).numpy())
    assert len({result.ctypes.data for result in results}) == len(results)


@pytest.mark.parametrize("environment_id", IDS)
def test_a_walker_accepts_tensors(environment_id):
    ours, twin = (make_ours(environment_id).unwrapped for _ in range(2))
    for environment in (ours, twin):
        environment.reset(seed=4)
    actions = random_actions(environment_id, 30)
    assert follow(ours, map(torch.from_numpy, actions)) == follow(twin, actions)


def test_step_some_and_send_accept_tensors():
    ours, twin = make_vector("Hopper-v5"), make_vector("Hopper-v5")
    ours.reset(seed=1)
    twin.reset(seed=1)
    chosen = torch.tensor([4, 0])
    given = ours.step(torch.full((2, 3), 0.5), chosen)
    expected = twin.step(np.full((2, 3), 0.5, np.float32), [4, 0])
    assert given[0].tobytes() == expected[0].tobytes()
    ours.send(torch.zeros(NUM_ENVS, 3))
    assert sorted(ours.recv()[-1]["env_id"]) == [*range(NUM_ENVS)]


def test_vector_wrapper_numpy_to_torch():
    """Not in same_step: the wrapper cannot convert final observations, an array of objects."""
    plain = make_vector("Walker2d-v5")
    wrapped = vector_wrappers.NumpyToTorch(make_vector("Walker2d-v5"))
    observations, _ = wrapped.reset(seed=2)
    assert isinstance(observations, torch.Tensor)
    assert np.array_equal(observations.numpy(), plain.reset(seed=2)[0])
    ends = 0
    for _ in range(50):
        actions = torch.rand(NUM_ENVS, 6) * 2 - 1
        *given, infos = wrapped.step(actions)
        *expected, _ = plain.step(actions.numpy())
        assert all(isinstance(one, torch.Tensor) for one in given)
        for one, other in zip(given, expected):
            assert one.numpy().dtype == other.dtype and one.numpy().tobytes() == other.tobytes()
        assert isinstance(infos["x_position"], torch.Tensor)
        ends += int((given[2] | given[3]).sum())
    assert ends > 3


def test_wrapper_numpy_to_torch():
    wrapped, plain = NumpyToTorch(make_ours("BipedalWalker-v3")), make_ours("BipedalWalker-v3")
    assert np.array_equal(wrapped.reset(seed=2)[0].numpy(), plain.reset(seed=2)[0])
    actions = torch.rand(4)
    assert np.array_equal(wrapped.step(actions)[0].numpy(), plain.step(actions.numpy())[0])


@pytest.mark.parametrize(
    ("actions", "words"),
    [
        (torch.zeros(NUM_ENVS, 4, requires_grad=True), "Use tensor.detach().numpy() instead"),
        (torch.zeros(NUM_ENVS, 4, device="meta"), "meta device"),
        (OnlyDlpack(torch.zeros(NUM_ENVS, 4, dtype=torch.bfloat16)), "must be an array of shape"),
        (torch.zeros(NUM_ENVS, 4, dtype=torch.complex64), "must hold numbers, not complex64"),
        (torch.full((NUM_ENVS, 4), torch.nan), "environment 0: action[0] (hip_1) = nan"),
    ],
)
def test_rejects_invalid_actions(actions, words):
    envs = make_vector("BipedalWalker-v3")
    envs.reset(seed=1)
    with pytest.raises(walker_sim.InvalidAction, match=re.escape(words)):
        envs.step(actions)


def test_package_does_not_import_torch():
    program = """
import sys, gymnasium, walker_sim, numpy
envs = gymnasium.make_vec("walker_sim/BipedalWalker-v3", 2)
envs.reset(seed=1)
envs.step(numpy.zeros((2, 4), numpy.float32))
assert "torch" not in sys.modules
"""
    run_python(program)
