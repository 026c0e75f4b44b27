"""Keyword arguments of environments, and the time limit that gymnasium.make keeps to itself."""

import copy

import gymnasium
import pytest
import walker_sim
from walker_sim.over_ros import ANY, limit_of_make
from walkers import IDS, make_many, make_ours

SHARED = ["transport", "server", "master_uri", "timeout", "spin_us", "render_mode"]
SHARED += ["max_episode_steps"]
VECTORS = ["num_envs", "num_threads", "batch_size", "autoreset_mode"]
WALKER2D = ["xml_file", "frame_skip", "healthy_z_range", "camera_name", "default_camera_config"]


def words_of(make, *arguments, **keywords):
    with pytest.raises(walker_sim.UnknownKeyword) as caught:
        make(*arguments, **keywords)
    return str(caught.value)


def known_in(words):
    return words.partition("Known: ")[2].partition(";")[0].split()


def make_vector(environment_id, **keywords):
    return make_many(environment_id, 2, **keywords)


@pytest.mark.parametrize(
    ("make", "given", "nearest"),
    [
        (make_ours, "trasnport", "transport"),
        (make_ours, "render_modes", "render_mode"),
        (make_ours, "hardcor", "hardcore"),
        (make_ours, "widht", "width"),
        (make_vector, "num_thread", "num_threads"),
        (make_vector, "autoreset", "autoreset_mode"),
    ],
)
def test_an_unknown_keyword_has_a_closest_match(make, given, nearest):
    words = words_of(make, "BipedalWalker-v3", **{given: 1})
    assert words.startswith(f"parameter {given} = 1: unknown; did you mean {nearest}? Known: ")


@pytest.mark.parametrize(
    ("make", "own"), [(make_ours, SHARED), (make_vector, SHARED + VECTORS)], ids=["one", "many"]
)
def test_all_keywords_are_listed(make, own):
    words = words_of(make, "Walker2d-v5", quux="a")
    assert words.startswith("parameter quux = 'a': unknown. Known: ")
    known = known_in(words)
    assert {*own, *WALKER2D} <= {*known}
    assert len(known) == len({*known})
    assert not {"env_id", "self", "parameters", "lookat"} & {*known}
    if make is make_ours:
        assert not {*VECTORS} & {*known}


def test_each_listed_keyword_is_known():
    words = words_of(make_vector, "Walker2d-v5", quux=0)
    for name in known_in(words):
        try:
            make_vector("Walker2d-v5", **{name: object()})
        except (TypeError, ValueError, RuntimeError) as error:
            assert "unknown" not in str(error), name


@pytest.mark.parametrize("make", [make_ours, make_vector])
@pytest.mark.parametrize("transport", ["inprocess", "ros"])
def test_an_unknown_keyword_is_a_type_error(make, transport):
    """TorchRL's GymEnv tries frameskip=1 and relies on this message to retry without it."""
    words = "unexpected keyword argument 'frameskip'"
    for kind in (TypeError, ValueError):
        with pytest.raises(kind, match=words):
            make("Walker2d-v5", frameskip=1, transport=transport)


@pytest.mark.parametrize("environment_id", IDS)
@pytest.mark.parametrize("kind", [walker_sim.WalkerEnv, walker_sim.WalkerVectorEnv])
def test_the_namespace_is_optional(kind, environment_id):
    first, second = kind(environment_id), kind(f"walker_sim/{environment_id}")
    assert first.reset(seed=1)[0].tobytes() == second.reset(seed=1)[0].tobytes()


# ---------------------------------------------------------------- the time limit


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


@pytest.fixture(params=[70, None])
def registered(request):
    kinds = {f"{kind.__name__}-v0": kind for kind in (Probe, Descendant, Container)}
    for name, kind in kinds.items():
        gymnasium.register(name, entry_point=kind, max_episode_steps=request.param)
    yield request.param or 0
    for name in kinds:
        del gymnasium.registry[name]


def test_the_limit_of_make(registered):
    changed = copy.deepcopy(gymnasium.spec("Probe-v0"))
    changed.max_episode_steps = 9
    own = gymnasium.make("Probe-v0", max_episode_steps=5).unwrapped.spec
    assert own.max_episode_steps is None  # Gymnasium's check_env makes copies from it
    for given, limit, expected in (
        ("Probe-v0", None, registered),
        ("Probe-v0", 5, 5),
        ("Probe-v0", -1, 0),
        ("Descendant-v0", None, registered),
        ("Descendant-v0", 5, 5),
        ("Container-v0", 5, None),
        (gymnasium.spec("Probe-v0"), None, registered),
        (changed, None, 9),
        (changed, 5, 5),
        (own, None, ANY),
        (own, 7, 7),
        (own, -1, 0),
    ):
        for made in (gymnasium.make(given, max_episode_steps=limit), gymnasium.make(given, limit)):
            assert made.unwrapped.limit == expected, (given, limit)


def test_the_limit_in_a_vector_environment(registered):
    def make():
        return gymnasium.make("Probe-v0", max_episode_steps=5)

    assert gymnasium.vector.SyncVectorEnv([make]).envs[0].unwrapped.limit == 5


def test_there_is_no_limit_without_make():
    assert Probe().limit is None
    assert Descendant().limit is None
