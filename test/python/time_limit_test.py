"""limit_of_make finds the time limit that gymnasium.make does not pass to the environment."""

import gymnasium
import pytest
from walker_sim.over_ros import ANY, limit_of_make


class Probe(gymnasium.Env):
    """An environment that records the limit found for it."""

    observation_space = action_space = gymnasium.spaces.Discrete(1)

    def __init__(self):
        self.limit = limit_of_make(Probe)


class Descendant(Probe):
    def __init__(self):
        super().__init__()


class Container(Probe):
    """An environment that asks for the limit of another class, as if it contained one."""

    def __init__(self):
        self.limit = limit_of_make(Descendant)


@pytest.fixture(autouse=True, params=[70, None])
def registered(request):
    names = {}
    for environment in (Probe, Descendant, Container):
        names[environment] = f"{environment.__name__}-v0"
        gymnasium.register(
            names[environment], entry_point=environment, max_episode_steps=request.param
        )
    yield request.param or 0
    for name in names.values():
        del gymnasium.registry[name]


def limit_of(*arguments, **options):
    return gymnasium.make(*arguments, **options).unwrapped.limit


@pytest.mark.parametrize("name", ["Probe-v0", "Descendant-v0"])
def test_the_limit_of_make(name, registered):
    assert limit_of(name) == registered
    assert limit_of(name, max_episode_steps=None) == registered
    assert limit_of(name, max_episode_steps=5) == 5
    assert limit_of(name, 5) == 5
    assert limit_of(name, max_episode_steps=-1) == 0


@pytest.mark.parametrize("limit", [None, 5, -1])
def test_an_unwrapped_spec_has_no_limit(limit):
    """An unwrapped spec has no limit; Gymnasium's check_env makes copies from it."""
    made = gymnasium.make("Probe-v0", max_episode_steps=limit)
    assert made.unwrapped.spec.max_episode_steps is None
    assert limit_of(made.unwrapped.spec) == ANY
    assert limit_of(made.unwrapped.spec, max_episode_steps=7) == 7
    assert limit_of(made.unwrapped.spec, max_episode_steps=-1) == 0


def test_the_limit_of_a_specification(registered):
    specification = gymnasium.spec("Probe-v0")
    assert limit_of(specification) == registered
    specification.max_episode_steps = 9
    assert limit_of(specification) == 9
    assert limit_of(specification, max_episode_steps=5) == 5


def test_in_a_vector_environment(registered):
    def make():
        return gymnasium.make("Probe-v0", max_episode_steps=5)

    assert gymnasium.vector.SyncVectorEnv([make]).envs[0].unwrapped.limit == 5


def test_without_make():
    assert Probe().limit is None
    assert Descendant().limit is None


def test_the_limit_of_another_environment_is_none():
    assert limit_of("Container-v0", max_episode_steps=5) is None
