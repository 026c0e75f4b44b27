"""Errors for invalid arguments name the argument, its shortened value and the allowed values."""

import itertools
import os
import pathlib

import gymnasium
import numpy as np
import pytest
import walker_sim
from walker_sim import _core
from walker_sim.files import package_file

WALKER = "walker_sim/Walker2d-v5"
HUGE = 10**400  # overflows a float
LONGER = 10**5000  # more digits than Python converts to text
SURROGATE = "\udcff.xml"  # Python's escape of a file name that is not UTF-8

REFUSED = [
    ({"healthy_reward": HUGE}, ValueError, "healthy_reward = 1000000", "between -1.8e+308 and"),
    ({"healthy_reward": -HUGE}, ValueError, "healthy_reward = -100000", "between -1.8e+308 and"),
    (
        {"healthy_reward": LONGER},
        ValueError,
        "healthy_reward = (of type int, too long",
        "must be a",
    ),
    ({"healthy_reward": float("nan")}, ValueError, "healthy_reward = .nan", "must be a number in"),
    ({"healthy_reward": "much"}, ValueError, "healthy_reward = much", "must be a number"),
    ({"healthy_reward": None}, TypeError, "healthy_reward = None", "must be a bool, an int"),
    ({"healthy_reward": 1j}, TypeError, "healthy_reward = 1j", "must be a bool, an int"),
    ({"healthy_reward": object}, TypeError, "healthy_reward = <class", "must be a bool, an int"),
    ({"healthy_reward": b"1"}, TypeError, "healthy_reward = b'1'", "must be a bool, an int"),
    (
        {"healthy_reward": np.longdouble(1)},
        TypeError,
        "healthy_reward = ",
        "must be a bool, an int",
    ),
    ({"frame_skip": 1 << 63}, ValueError, "frame_skip = 9.223372036854776e+18", "integer in [1,"),
    ({"frame_skip": HUGE}, ValueError, "frame_skip = 10000000", "must be a number between"),
    ({"frame_skip": 1.5}, ValueError, "frame_skip = 1.5", "must be an integer in [1,"),
    ({"healthy_z_range": (0, HUGE)}, ValueError, "healthy_z_range = (0, 1000", "between -1.8e+308"),
    ({"healthy_z_range": "0.8"}, ValueError, "healthy_z_range = 0.8", "must be a list of numbers"),
    ({"healthy_z_range": {}}, ValueError, "healthy_z_range = []", "must be a list of 2 numbers"),
    ({"healthy_z_range": ["1", "2"]}, TypeError, "healthy_z_range = ['1', '2']", "must be a bool"),
    (
        {"healthy_z_range": itertools.count()},
        TypeError,
        "healthy_z_range = count(",
        "a sequence of",
    ),
    ({"healthy_z_range": [0] * 999}, ValueError, "healthy_z_range = [0.0, 0.0, 0.0", "list of 2"),
    ({"xml_file": SURROGATE}, ValueError, "xml_file = '\\udcff.xml'", "must be a text that UTF-8"),
    ({"xml_file": pathlib.Path(SURROGATE)}, ValueError, "xml_file = '\\udcff.xml'", "UTF-8 has"),
    ({"xml_file": b"model.xml"}, TypeError, "xml_file = b'model.xml'", "must be a bool, an int"),
    ({"xml_file": b"\xff" * 9999}, TypeError, "xml_file = b'\\xff\\xff", "must be a bool, an int"),
    ({"xml_file": "no.xml\0junk"}, ValueError, "xml_file = no.xml\\x00junk", "zero byte"),
    ({"xml_file": "x" * 99999}, ValueError, "xml_file = xxxxxx", "99699 bytes left out"),
    ({"xml_file": "/dev/zero"}, ValueError, "xml_file = /dev/zero", "a regular file"),
    ({"xml_file": 7}, ValueError, "xml_file = 7", "must be a text"),
    ({"no_such": HUGE}, ValueError, "no_such = 10000000", "unknown"),
    ({"no_such": LONGER}, ValueError, "no_such = (of type int, too long", "unknown"),
    ({"\udcff": 1}, ValueError, "\\udcff", "unknown"),
    ({"max_episode_steps": HUGE}, ValueError, "max_episode_steps = 1000000", "between"),
    ({"max_episode_steps": "long"}, ValueError, "max_episode_steps = long", "must be an integer"),
    ({"transport": SURROGATE}, ValueError, "transport = '\\udcff.xml'", "must be one of"),
    ({"transport": HUGE}, ValueError, "transport = 100000", "must be one of"),
    ({"transport": LONGER}, ValueError, "transport = (of type int", "must be one of"),
    ({"render_mode": LONGER}, ValueError, "render_mode = (of type int", "must be None or one of"),
    ({"render_mode": "rgb_array", "width": HUGE}, ValueError, "width = 1000000", "between"),
    ({"render_mode": "rgb_array", "width": 10**9}, ValueError, "width = 1000000000", "in [1,"),
    ({"camera_name": SURROGATE}, ValueError, "camera_name = '\\udcff.xml'", "UTF-8"),
    ({"default_camera_config": LONGER}, TypeError, "default_camera_config = (of", "dictionary"),
    ({"default_camera_config": {"distance": HUGE}}, ValueError, "distance = 1000", "between"),
    ({"default_camera_config": {"\udcff": 1}}, ValueError, "\\udcff", "must be one of"),
]


def make(**keywords):
    return walker_sim.WalkerEnv(WALKER, **keywords)


def make_vector(**keywords):
    return walker_sim.WalkerVectorEnv(WALKER, num_envs=2, **keywords)


def numbered(cases):
    """Returns test ids by number, because Python cannot print all of the values."""
    return range(len(cases))


@pytest.mark.parametrize("maker", [make, make_vector])
@pytest.mark.parametrize(("keywords", "kind", "thing", "rule"), REFUSED, ids=numbered(REFUSED))
def test_keywords_are_refused_by_name(maker, keywords, kind, thing, rule):
    if maker is make_vector and keywords.get("max_episode_steps") == "long":
        kind = (ValueError, TypeError)
    with pytest.raises(kind) as refused:
        env = maker(**keywords)
        env.reset(seed=0)
        env.render()
    assert_says(refused, thing, rule)


def assert_says(refused, *words):
    text = str(refused.value)
    for word in words:
        assert word in text
    assert "Unable to cast" not in text
    assert "incompatible" not in text
    assert "\n" not in text
    assert len(text) < 2000  # the rule may name every keyword


IDS = ["\udcff", 7, None, LONGER, "Walker2d-v5\0", "x" * 9999]


@pytest.mark.parametrize("env_id", IDS, ids=numbered(IDS))
@pytest.mark.parametrize("kind", [walker_sim.WalkerEnv, walker_sim.WalkerVectorEnv])
def test_ids_are_refused_by_name(kind, env_id):
    with pytest.raises((ValueError, TypeError)) as refused:
        kind(env_id, **({"num_envs": 1} if kind is walker_sim.WalkerVectorEnv else {}))
    assert_says(refused, "environment ")


COUNTS = [
    ({"num_envs": HUGE}, ValueError, "num_envs = 1000000"),
    ({"num_envs": LONGER}, ValueError, "num_envs = (of type int"),
    ({"num_envs": -LONGER}, ValueError, "num_envs = (of type int"),
    ({"num_envs": 1 << 64}, ValueError, "num_envs = 18446744073709551616"),
    ({"num_envs": 1 << 62}, ValueError, "num_envs = 4611686018427387904"),
    ({"num_envs": 1.0}, TypeError, "num_envs = 1.0"),
    ({"num_envs": "2"}, TypeError, "num_envs = '2'"),
    ({"num_envs": 1, "num_threads": HUGE}, ValueError, "num_threads = 1000000"),
    ({"num_envs": 1, "num_threads": -1}, ValueError, "num_threads = -1"),
    ({"num_envs": 2, "batch_size": HUGE}, ValueError, "batch_size = 1000000"),
    ({"num_envs": 2, "batch_size": 3}, ValueError, "batch_size = 3"),
    ({"num_envs": 1, "autoreset_mode": LONGER}, ValueError, "autoreset_mode = (of type int"),
    ({"num_envs": 1, "autoreset_mode": SURROGATE}, ValueError, "autoreset_mode = '\\udcff"),
]


@pytest.mark.parametrize(("keywords", "kind", "thing"), COUNTS, ids=numbered(COUNTS))
def test_numbers_of_walkers_are_refused_by_name(keywords, kind, thing):
    with pytest.raises(kind) as refused:
        walker_sim.WalkerVectorEnv(WALKER, **keywords)
    assert_says(refused, thing, "must be")


PLACES = [
    ({"server": SURROGATE}, "server = '\\udcff.xml'"),
    ({"server": 7}, "server = 7"),
    ({"server": LONGER}, "server = (of type int"),
    ({"master_uri": SURROGATE}, "master_uri = '\\udcff.xml'"),
    ({"master_uri": "http://localhost:11\x0011"}, "http://localhost:11\\x0011"),
    ({"timeout": HUGE}, "timeout = 1000000"),
    ({"timeout": LONGER}, "timeout = (of type int"),
    ({"timeout": "1"}, "timeout = '1'"),
    ({"timeout": float("nan")}, "timeout = nan"),
    ({"timeout": -1}, "timeout = -1"),
]


@pytest.mark.parametrize(("place", "thing"), PLACES, ids=numbered(PLACES))
@pytest.mark.parametrize("maker", [make, make_vector])
def test_places_of_servers_are_refused_by_name(maker, place, thing):
    with pytest.raises((ValueError, TypeError, ConnectionError)) as refused:
        maker(transport="ros", **{"master_uri": "http://localhost:1", **place})
    assert_says(refused, thing, "must be")


@pytest.fixture(scope="module")
def env():
    env = make()
    env.reset(seed=0)
    return env


@pytest.fixture(scope="module")
def vector():
    vector = make_vector()
    vector.reset(seed=0)
    return vector


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_actions_that_are_not_aligned_are_taken(env, vector, dtype):
    values = np.linspace(-0.9, 0.9, 12).astype(dtype)
    for offset in range(1, 8):
        memory = bytearray(offset) + values.tobytes()
        unaligned = np.frombuffer(memory, dtype, offset=offset)
        assert not unaligned.flags.aligned or offset % values.itemsize == 0
        for driver, action in ((env, unaligned[:6]), (vector, unaligned.reshape(2, 6))):
            driver.reset(seed=offset)
            observation, reward, *_ = driver.step(action)
            driver.reset(seed=offset)
            expected, expected_reward, *_ = driver.step(np.array(action.tolist(), dtype))
            assert observation.tobytes() == expected.tobytes()
            assert np.array_equal(reward, expected_reward)


STRANGE_ACTIONS = [
    None,
    "up",
    b"123456",
    {},
    object(),
    [HUGE] * 6,
    [LONGER] * 6,
    [[0, 1], [2]],
    [1j] * 6,
    [None] * 6,
    ["1"] * 6,
    [float("nan")] * 6,
    [float("inf")] * 6,
    np.zeros(5),
    np.zeros((6, 1)),
    np.zeros((2, 3)),
    np.zeros(0),
    np.float64(0),
    np.zeros(6, "datetime64[s]"),
    np.zeros(6, [("a", "f8")]),
    np.array([object()] * 6),
    np.full(6, np.longdouble("1e400")),
    "x" * 99999,
]


@pytest.mark.filterwarnings("ignore::RuntimeWarning", "ignore::DeprecationWarning")
@pytest.mark.parametrize("given", STRANGE_ACTIONS, ids=numbered(STRANGE_ACTIONS))
def test_strange_actions_are_refused_and_nothing_moves(env, vector, given):
    for driver in (env, vector):
        before = driver.get_state()
        with pytest.raises(walker_sim.InvalidAction) as refused:
            driver.step(given)
        assert_says(refused, "action")
        assert driver.get_state() == before


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_byte_orders_and_other_types_are_taken(env):
    values = np.array([0.5, -0.25, 0.125, 1, -1, 0])
    results = []
    for action in (
        values,
        values.astype(">f8"),
        values.astype("f2"),
        values.astype("g"),
        [*values],
    ):
        env.reset(seed=1)
        results.append(env.step(action)[0].tobytes())
    assert len({*results}) == 1


SEEDS = [-1, -HUGE, 1.0, "1", b"1", None, [], {}, LONGER, HUGE, 1 << 64, float("nan"), True]


@pytest.mark.parametrize("seed", SEEDS, ids=numbered(SEEDS))
def test_seeds_are_as_gymnasiums(seed):
    """Accepted seeds and error messages equal Gymnasium's."""

    def outcome_of(environment):
        try:
            return environment.reset(seed=seed)[1] is not None
        except Exception as error:
            return type(error), str(error)

    ours, theirs = make(), gymnasium.make("Walker2d-v5").unwrapped
    assert outcome_of(ours) == outcome_of(theirs)


SEEDS_OF_MANY = [-1, -HUGE, 1.5, "1", [1], [1, 2, 3], [1, "2"], [1, -1], -LONGER]


@pytest.mark.parametrize("seed", SEEDS_OF_MANY, ids=numbered(SEEDS_OF_MANY))
def test_seeds_of_many_are_refused(vector, seed):
    before = vector.get_state()
    with pytest.raises((ValueError, TypeError, gymnasium.error.Error)) as refused:
        vector.reset(seed=seed)
    assert "eed" in str(refused.value)
    assert len(str(refused.value)) < 1000
    assert vector.get_state() == before


OPTIONS = [
    (7, "options = 7: must be a dictionary"),
    ("all", "options = 'all': must be a dictionary"),
    (LONGER, "options = (of type int, too long to be shown): must be a dictionary"),
    ({"reset_mask": None}, "options['reset_mask'] is of NoneType; must be a NumPy array of bool"),
    ({"reset_mask": [True, True]}, "options['reset_mask'] is of list; must be a NumPy array of"),
    ({"reset_mask": np.ones(2)}, "options['reset_mask'] is of float64; must be a NumPy array of"),
]


@pytest.mark.parametrize(("options", "message"), OPTIONS, ids=numbered(OPTIONS))
def test_options_of_many_are_refused(vector, options, message):
    before = vector.get_state()
    with pytest.raises(TypeError) as refused:
        vector.reset(options=options)
    assert message in str(refused.value)
    assert vector.get_state() == before


INDICES = [
    [2],
    [-1],
    [0, 0],
    [HUGE],
    [LONGER],
    ["0"],
    [0.0],
    [[0]],
    [[0], [1, 2]],
    0,
    "0",
    [1 << 63],
]


@pytest.mark.parametrize("indices", INDICES, ids=numbered(INDICES))
def test_numbers_of_walkers_that_are_none_are_refused(vector, indices):
    actions = np.zeros((1, 6))
    before = vector.get_state()
    for call in (
        lambda: vector.step(actions, indices),
        lambda: vector.send(actions, indices),
        lambda: vector.set_state(before[:1], indices),
        lambda: vector.get_state(indices),
    ):
        if indices == [0, 0]:
            continue  # vector_arguments_test.py tests duplicates
        with pytest.raises((ValueError, TypeError)) as refused:
            call()
        assert_says(refused, "must be")
    assert vector.get_state() == before


STATES = [None, 7, "", b"", b"\0" * 9, (), (1, 2), [b""], bytearray(b"123"), LONGER, "\udcff"]


@pytest.mark.parametrize("state", STATES, ids=numbered(STATES))
def test_states_that_are_none_are_refused(env, vector, state):
    for driver, given in ((env, state), (vector, [state, state]), (vector, state)):
        before = driver.get_state()
        with pytest.raises((ValueError, TypeError)) as refused:
            driver.set_state(given)
        assert "state" in str(refused.value)
        assert "Unable to cast" not in str(refused.value)
        assert driver.get_state() == before


def test_damaged_states_are_refused(env):
    whole = env.get_state()
    random = np.random.default_rng(0)
    for _ in range(200):
        damaged = bytearray(whole)
        for place in random.integers(len(whole), size=random.integers(1, 4)):
            damaged[place] ^= 1 << random.integers(8)
        if random.random() < 0.3:
            damaged = damaged[: random.integers(len(whole))]
        if bytes(damaged) == whole:
            continue
        with pytest.raises(ValueError, match="state"):
            env.set_state(bytes(damaged))
    assert env.get_state() == whole


POLICIES = ["no.safetensors\0junk", os.fsencode("\udcff"), "/dev/zero", "/"]


@pytest.mark.parametrize("name", POLICIES, ids=numbered(POLICIES))
def test_files_of_policies_are_refused_by_name(name):
    with pytest.raises(ValueError, match="policy ") as refused:
        _core.Policy(name)
    assert_says(refused, "it ")


def test_rows_that_are_no_observations_are_refused():
    policy = _core.Policy(str(package_file("assets/policies/Walker2d-v5.safetensors")))
    with pytest.raises(ValueError, match="observations has 35 values; must have 17 a row"):
        policy.act(np.zeros(35), np.zeros(12))
    with pytest.raises(ValueError, match="actions has 6 values; must have 12"):
        policy.act(np.zeros((2, 17)), np.zeros(6))
    with pytest.raises(ValueError, match="policy after 7 steps: it has 3 bytes"):
        _core.Policy.from_bytes("after 7 steps", b"abc")


def test_a_pipe_is_no_policy(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(ValueError, match="must be a regular file"):
        _core.Policy(str(tmp_path / "pipe"))
