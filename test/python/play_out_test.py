"""play_out: the episodes that a policy plays step by step, and errors that name what is wrong."""

import gymnasium
import numpy as np
import pytest
import walker_sim
from walker_sim import _core
from walker_sim.commands.policies import acting, shipped_policy
from walker_sim.errors import UnknownKeyword
from walkers import play

ID = "BipedalWalker-v3"


def changed(policy, by):
    """Returns a policy whose parameters are a little off."""
    parameters = np.array(policy.parameters)
    parameters[::7] += by
    return policy.with_parameters(parameters)


@pytest.mark.parametrize("env_id", [ID, "Walker2d-v5"])
def test_episodes_are_those_of_gymnasiums_interface(env_id):
    first = _core.Policy(str(shipped_policy(env_id)))
    policies = [first, changed(first, 0.05)]
    worlds = [None, "pushed"]
    found = walker_sim.play_out(f"walker_sim/{env_id}", policies, [8, 3], worlds=worlds)
    assert found.returns.shape == (2, 2, 2)
    for place in np.ndindex(2, 2, 2):
        environment = gymnasium.make(f"walker_sim/{env_id}", world=worlds[place[1]])
        policy = acting(policies[place[0]], policies[place[0]].action_size)
        expected, _ = play(environment, [8, 3][place[2]], policy)
        assert tuple(array[place] for array in found[:4]) == expected
        assert (found.ends[place] == "time limit") == (not expected[2])


def test_a_policy_may_be_a_file_or_its_content():
    path = shipped_policy(ID)
    one = walker_sim.play_out(ID, path, range(3), max_episode_steps=40)
    for given in (str(path), [path.read_bytes()]):
        other = walker_sim.play_out(ID, given, range(3), max_episode_steps=40, num_threads=1)
        assert all(map(np.array_equal, one, other))
    assert one.lengths.tolist() == [[[40] * 3]]
    assert set(one.ends.flat) == {"time limit"}


def test_parameters_of_a_policy_survive_the_round_trip():
    policy = _core.Policy(str(shipped_policy(ID)))
    again = policy.with_parameters(np.array(policy.parameters, np.float32))
    assert again.parameters == policy.parameters
    actions = np.empty((2, 4))
    for each, row in zip((policy, again), actions):
        each.act(np.linspace(-1, 1, 24), row)
    assert np.array_equal(*actions)


@pytest.mark.parametrize(
    ("arguments", "keywords", "error", "words"),
    [
        (("Walker9d-v5", [], [1]), {}, ValueError, "Walker9d-v5"),
        ((ID, b"", [1]), {}, ValueError, "policy content: "),
        ((ID, [], [1.5]), {}, TypeError, "seed = 1.5: must be an integer"),
        ((ID, [], [-1]), {}, ValueError, "seed = -1: must be from 0"),
        ((ID, [], [1 << 64]), {}, ValueError, "must be from 0 to 2^64 - 1"),
        ((ID, [], [1]), {"num_threads": -1}, ValueError, "num_threads = -1"),
        ((ID, [], [1]), {"hardcor": True}, UnknownKeyword, "did you mean hardcore"),
    ],
)
def test_errors_name_what_is_wrong(arguments, keywords, error, words):
    with pytest.raises(error) as caught:
        walker_sim.play_out(*arguments, **keywords)
    assert words in str(caught.value)


def test_an_exception_of_the_receiver_ends_the_call():
    player = _core.EpisodePlayer("Walker2d-v5", {"max_episode_steps": 20}, 2, 0, False)
    policy = _core.Policy(str(shipped_policy("Walker2d-v5")))
    jobs = [(0, seed, 0) for seed in range(200)]
    seen = []

    def receive(job, *fields):
        seen.append(job)
        if len(seen) == 3:
            raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        player.play([policy], [], jobs, receive)
    assert len(seen) == 3
    player.play([policy], [], jobs, lambda job, *fields: seen.append(job))
    assert sorted(seen[3:]) == list(range(200))


@pytest.mark.parametrize("env_id", ["Walker2d-v5", "Hopper-v5"])
def test_a_smoother_floor_than_the_limbs_changes_no_bit(env_id):
    """A contact has the larger friction of floor and limb: 0.9, and 1.9 or 2 at the feet. So RRLS's
    values from 0.1 to 0.9 are one world, and up to the feet's friction only the shins feel more."""
    worlds = [{"floor_friction": each} for each in (0, 0.5, 0.9, 2.1)]
    played = walker_sim.play_out(
        env_id, shipped_policy(env_id), range(3), worlds=worlds, max_episode_steps=200
    )
    *smooth, rough = played.returns[0].tolist()
    assert all(returns == smooth[0] for returns in smooth)
    assert all(one != other for one, other in zip(rough, smooth[0]))
