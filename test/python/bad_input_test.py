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

HUGE = 10**400  # overflows a float
LONGER = 10**5000  # more digits than Python converts to text
SURROGATE = "\udcff.xml"  # Python's escape of a file name that is not UTF-8
NAN, INFINITY = float("nan"), float("inf")
TYPES = "must be a bool, an int"
ROBOTS_MODES = "must be None or one of human, rgb_array, depth_array, rgbd_tuple"

# Keyword, value, error, named value, allowed values. test/base/parameters_test.cpp has others.
KEYWORDS = {
    "Walker2d-v5": [
        ("healthy_reward", HUGE, ValueError, "= 1000000", "between -1.8e+308 and"),
        ("healthy_reward", LONGER, ValueError, "= (of type int, too long", "must be a"),
        ("healthy_reward", None, TypeError, "= None", TYPES),
        ("healthy_reward", object, TypeError, "= <class", TYPES),
        ("healthy_reward", b"1", TypeError, "= b'1'", TYPES),
        ("healthy_reward", np.longdouble(1), TypeError, "= ", TYPES),
        ("frame_skip", 1 << 63, ValueError, "= 9.223372036854776e+18", "integer in [1,"),
        ("healthy_z_range", (0, HUGE), ValueError, "= (0, 1000", "between -1.8e+308"),
        ("healthy_z_range", {}, ValueError, "= []", "must be a list of 2 numbers"),
        ("healthy_z_range", (1, "2"), TypeError, "= (1, '2')", "a sequence of numbers"),
        ("healthy_z_range", itertools.count(), TypeError, "= count(", "a sequence of"),
        ("xml_file", "/no/such.xml", ValueError, "/no/such.xml", ""),
        ("xml_file", SURROGATE, ValueError, "= '\\udcff.xml'", "must be a text that UTF-8"),
        ("xml_file", pathlib.Path(SURROGATE), ValueError, "= '\\udcff.xml'", "UTF-8 can encode"),
        ("xml_file", b"\xff" * 9999, TypeError, "= b'\\xff\\xff", TYPES),
        ("no_such", LONGER, ValueError, "= (of type int, too long", "unknown"),
        ("\udcff", 1, ValueError, "\\udcff", "unknown"),
        ("max_episode_steps", HUGE, ValueError, "= 1000000", "between"),
        ("transport", "udp", ValueError, "= 'udp'", "must be one of inprocess, ros"),
        ("transport", LONGER, ValueError, "= (of type int", "must be one of"),
        ("render_mode", "smoke", ValueError, "= 'smoke'", ROBOTS_MODES),
        ("render_mode", LONGER, ValueError, "= (of type int", "must be None or one of"),
        ("width", HUGE, ValueError, "= 1000000", "between"),
        ("width", 10**9, ValueError, "= 1000000000", "in [1,"),
        ("camera_id", 7, ValueError, "= 7", ""),
        ("camera_name", SURROGATE, ValueError, "= '\\udcff.xml'", "UTF-8"),
        ("default_camera_config", LONGER, TypeError, "= (of", "dictionary"),
        ("default_camera_config", {"zoom": 2}, ValueError, "zoom = 2", "must be one of dist"),
        ("default_camera_config", {"distance": HUGE}, ValueError, "distance = 1000", "between"),
        ("default_camera_config", {"\udcff": 1}, ValueError, "\\udcff", "must be one of"),
    ],
    "Walker2d-v4": [
        ("frame_skip", 4, ValueError, "= 4", "unknown"),
        ("default_camera_config", {"distance": 2.0}, ValueError, "= {'distance'", "unknown"),
    ],
    "BipedalWalker-v3": [
        ("hardcore", None, TypeError, "= None", TYPES),
        ("camera_id", 0, ValueError, "= 0", "unknown"),
        ("render_mode", "depth_array", ValueError, "= 'depth_array'", "one of human, rgb_array"),
    ],
}
CASES = [(env_id, *row) for env_id, rows in KEYWORDS.items() for row in rows]


def make(env_id="Walker2d-v5", **keywords):
    return walker_sim.WalkerEnv(env_id, **keywords)


def make_vector(env_id="Walker2d-v5", **keywords):
    return walker_sim.WalkerVectorEnv(env_id, num_envs=2, **keywords)


MAKERS = pytest.mark.parametrize("maker", [make, make_vector])


def rows(names, table):
    """Parametrizes a test, with ids by number, because Python cannot print all of the values."""
    return pytest.mark.parametrize(names, table, ids=range(len(table)))


def assert_refused(error, words, call, *arguments, **keywords):
    """Asserts that a call raises a short error whose message contains these words."""
    with pytest.raises(error) as refused:
        call(*arguments, **keywords)
    text = str(refused.value)
    for word in words:
        assert word in text
    assert "Unable to cast" not in text
    assert "incompatible" not in text
    assert "\n" not in text
    assert len(text) < 2000  # the message may list every keyword


@MAKERS
@rows(("env_id", "name", "value", "error", "thing", "rule"), CASES)
def test_keywords(maker, env_id, name, value, error, thing, rule):
    named = f"{name} {thing}" if thing.startswith("=") else thing
    assert_refused(error, [named, rule], maker, env_id, **{name: value})


@MAKERS
def test_two_cameras(maker):
    words = ["only one of them can be given"]
    assert_refused(ValueError, words, maker, camera_id=0, camera_name="track")


@rows(
    ("env_id", "error", "thing"),
    [
        *((text, (ValueError, TypeError), "") for text in ("\udcff", "Walker2d-v5\0")),
        *((value, (ValueError, TypeError), "") for value in (7, None, LONGER)),
        ("x" * 9999, ValueError, ""),
        ("Walker2d-v3", ValueError, "Walker2d-v3: unknown"),
        ("walker_sim/Ant-v4", ValueError, "Ant-v4: unknown"),
        ("other/Walker2d-v5", ValueError, "other/Walker2d-v5: unknown"),
    ],
)
@MAKERS
def test_ids(maker, env_id, error, thing):
    assert_refused(error, [f"environment {thing}"], maker, env_id)


COUNTS = [
    ({"num_envs": 0}, ValueError, "num_envs = 0: must be at least 1"),
    ({"num_envs": LONGER}, ValueError, "num_envs = (of type int"),
    ({"num_envs": -LONGER}, ValueError, "num_envs = (of type int"),
    ({"num_envs": 1 << 62}, ValueError, "num_envs = 4611686018427387904"),
    ({"num_envs": 2**21}, ValueError, "num_envs = 2097152: must be in [1, 1048576]"),
    ({"num_envs": 1.0}, TypeError, "num_envs = 1.0: must be an integer"),
    ({"num_threads": -1}, ValueError, "num_threads = -1: must be at least 0"),
    ({"transport": "ros", "num_threads": 2}, ValueError, "num_threads = 2: over ROS"),
    ({"batch_size": -2}, ValueError, "batch_size = -2: must be at least 0"),
    ({"transport": "ros", "batch_size": 2}, ValueError, "batch_size = 2: over ROS"),
    ({"autoreset_mode": "never"}, ValueError, "autoreset_mode = 'never': must be next_step, s"),
    ({"autoreset_mode": 3}, ValueError, "autoreset_mode = 3: must be next_step, same_step or"),
    ({"autoreset_mode": LONGER}, ValueError, "autoreset_mode = (of type int"),
]


@rows(("keywords", "error", "thing"), COUNTS)
def test_keywords_of_vector_environments(keywords, error, thing):
    keywords = {"num_envs": 1, **keywords}
    assert_refused(error, [thing, "must be"], walker_sim.WalkerVectorEnv, "Walker2d-v5", **keywords)


ADDRESSES = [
    ({"server": "walker_sim"}, ValueError, 'server = "walker_sim"; must be a node\'s full name'),
    ({"server": SURROGATE}, ValueError, "server = '\\udcff.xml'"),
    ({"server": None}, TypeError, "server = None: must be a str"),
    ({"server": LONGER}, TypeError, "server = (of type int"),
    ({"master_uri": 11311}, TypeError, "master_uri = 11311: must be a str"),
    ({"master_uri": SURROGATE}, ValueError, "master_uri = '\\udcff.xml'"),
    ({"master_uri": "http://localhost:11\x0011"}, ValueError, "http://localhost:11\\x0011"),
    ({"timeout": LONGER}, ValueError, "timeout = (of type int"),
    ({"timeout": "10"}, TypeError, "timeout = '10': must be a number of seconds"),
    ({"spin_us": -1}, ValueError, "spin_us = -1"),
    ({"spin_us": 1001}, ValueError, "spin_us = 1001 us; must be an integer in"),
    ({"spin_us": 1.5}, TypeError, "spin_us = 1.5"),
]


@rows(("address", "error", "thing"), ADDRESSES)
@MAKERS
def test_addresses_of_servers(maker, address, error, thing):
    address = {"master_uri": "http://localhost:1", **address}
    assert_refused(error, [thing, "must be"], maker, transport="ros", **address)


def begun(driver):
    driver.reset(seed=0)
    return driver


@pytest.fixture(scope="module")
def env():
    return begun(make())


@pytest.fixture(scope="module")
def vector():
    return begun(make_vector())


# ---------------------------------------------------------------- actions


def outcome_of(driver, action, seed=1):
    driver.reset(seed=seed)
    return [np.asarray(value).tobytes() for value in driver.step(action)[:4]]


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_unaligned_actions_are_accepted(env, vector, dtype):
    values = np.linspace(-0.9, 0.9, 12).astype(dtype)
    for offset in range(1, 8):
        memory = bytearray(offset) + values.tobytes()
        unaligned = np.frombuffer(memory, dtype, offset=offset)
        assert not unaligned.flags.aligned or offset % values.itemsize == 0
        for driver, action in ((env, unaligned[:6]), (vector, unaligned.reshape(2, 6))):
            assert outcome_of(driver, action) == outcome_of(driver, np.array(action.tolist()))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@rows(
    "convert",
    [
        *(np.float32, np.float64, np.float16, np.longdouble, np.int8, np.array, list),
        lambda action: action.tolist(),
        lambda action: tuple(map(tuple, action)) if action.ndim > 1 else tuple(action),
        np.asfortranarray,
        lambda action: np.repeat(action, 2, -1)[..., ::2],
        lambda action: action[::-1].copy()[::-1],
        lambda action: action.astype(">f8"),
    ],
)
def test_all_forms_of_numbers_are_accepted(env, vector, convert):
    actions = np.array([[1.0, -1, 1, 1, -1, 0], [-1, -1, 0, 1, 1, 1]])
    for driver, action in ((env, actions[0]), (vector, actions)):
        assert outcome_of(driver, convert(action)) == outcome_of(driver, action)


NOT_NUMBERS = [
    (None, " = None: must hold numbers, not object"),
    ("up", " = 'up': must hold numbers, not <U2"),
    (object(), "must hold numbers, not object"),
    ([LONGER] * 6, "must hold numbers, not object"),
    ([[0, 1], [2]], "must be an array of shape"),
    ([[0.5], *[0] * 5], "must be an array of shape"),
    ([1j] * 6, "must hold numbers, not complex128"),
    (np.zeros(6, "datetime64[s]"), "must hold numbers, not datetime64[s]"),
    (np.zeros(6, [("a", "f8")]), "must hold numbers, not [("),
    ("x" * 99999, "must hold numbers, not <U99999"),
]


SINGLE_ACTIONS = [
    ([NAN, *[0] * 5], "action[0] (thigh_joint) = nan; must be"),
    ([*[0] * 5, -INFINITY], "action[5] (foot_left_joint) = -inf; must be"),
    (np.full(6, np.longdouble("1e400")), "action[0] (thigh_joint) = inf; must be"),
    (np.zeros(5), "action has shape (5,); must have (6,)"),
    (np.zeros((6, 1)), "action has shape (6, 1); must have (6,)"),
    (np.float64(0), "action has shape (); must have (6,)"),
]
VECTOR_ACTIONS = [
    ([[0] * 6, [*[0] * 5, NAN]], "environment 1: action[5] (foot_left_joint) = nan; must be"),
    (np.zeros(12), "actions have shape (12,); must have (2, 6)"),
    ([[0] * 6, [0] * 5], "must be an array of shape (2, 6)"),
]
ACTIONS = [
    *(("env", *row) for row in NOT_NUMBERS + SINGLE_ACTIONS),
    *(("vector", *row) for row in NOT_NUMBERS + VECTOR_ACTIONS),
]


@pytest.mark.filterwarnings("ignore::RuntimeWarning", "ignore::DeprecationWarning")
@rows(("driver", "given", "message"), ACTIONS)
def test_refused_actions_change_nothing(request, driver, given, message):
    driver = request.getfixturevalue(driver)
    before = driver.get_state()
    assert_refused(walker_sim.InvalidAction, ["action", message], driver.step, given)
    for kind in (gymnasium.error.InvalidAction, ValueError):
        assert issubclass(walker_sim.InvalidAction, kind)
    assert driver.get_state() == before


# ---------------------------------------------------------------- seeds, options, indices, states


SEEDS = [
    (-1, gymnasium.error.Error, "Seed must be greater or equal to zero, actual value: -1"),
    (-LONGER, gymnasium.error.Error, "actual value: (of type int, too long"),
    ([1, -2], gymnasium.error.Error, "actual value: -2"),
    (1.5, TypeError, "seed = 1.5: must be None, an integer, or a sequence of these"),
    ("1", TypeError, "seed = '1': must be None, an integer, or a sequence of these"),
    ([1, "2"], TypeError, "seed = [1, '2']: must be None, an integer, or a sequence of these"),
    ([1], ValueError, "1 seeds; must be 2, one for each walker"),
    ([1, 2, 3], ValueError, "3 seeds; must be 2, one for each walker"),
]
OPTIONS = [
    (7, "options = 7: must be a dictionary"),
    (LONGER, "options = (of type int, too long to be shown): must be a dictionary"),
    ({"reset_mask": None}, "options['reset_mask'] is of NoneType; must be a NumPy array of bool"),
]
RESETS = [
    *(({"seed": seed}, error, message) for seed, error, message in SEEDS),
    *(
        ({"seed": seed, "options": {"world": "pushed"}}, error, message)
        for seed, error, message in SEEDS
    ),
    *(({"options": options}, TypeError, message) for options, message in OPTIONS),
]


@rows(("keywords", "error", "message"), RESETS)
def test_refused_resets_of_a_vector_environment_change_nothing(vector, keywords, error, message):
    before = vector.get_state()
    assert_refused(error, [message], vector.reset, **keywords)
    assert vector.get_state() == before


INTEGERS = ": must be a sequence of integers"
INDICES = [
    ([2], ValueError, "environment 2: must be in [0, 1]"),
    ([-1], ValueError, "environment -1: must be in [0, 1]"),
    ([1 << 63], ValueError, "environment 9223372036854775808: must be in [0, 1]"),
    ([LONGER], TypeError, INTEGERS),
    ([0.5], TypeError, f" = [0.5]{INTEGERS}"),
    ([[0]], TypeError, INTEGERS),
    ([[0], [1, 2]], TypeError, INTEGERS),
    ([True, False], TypeError, f" = [True, False]{INTEGERS}"),
    (0, TypeError, f" = 0{INTEGERS}"),
    ([1, 1], ValueError, "environment 1: listed twice"),
]


@rows(("indices", "error", "message"), INDICES)
def test_indices_of_walkers(vector, indices, error, message):
    count = np.size(indices) if message.startswith("env") else 1
    actions, before = np.zeros((count, 6)), vector.get_state()
    calls = [
        lambda: vector.step(actions, indices),
        lambda: vector.send(actions, indices),
        lambda: vector.set_state(before[:1] * count, indices),
        lambda: vector.set_world("moon", indices),
        lambda: vector.get_state(indices),
    ]
    for call in calls[: 4 if indices == [1, 1] else 5]:  # get_state returns duplicates
        assert_refused(error, [message], call)
    assert vector.get_state() == before


def test_actions_of_some_walkers(vector):
    before = vector.get_state()
    with pytest.raises(walker_sim.InvalidAction, match=r"shape \(2, 6\); must have \(1, 6\)"):
        vector.step(np.zeros((2, 6)), [0])
    with pytest.raises(ValueError, match="step: no environment is listed"):
        vector.step(np.zeros((0, 6)), [])
    assert vector.get_state() == before


STATES = [None, 7, "", b"", b"\0" * 9, (), (1, 2), [b""], bytearray(b"123"), LONGER, "\udcff"]


@rows("state", STATES)
def test_refused_states_change_nothing(env, vector, state):
    for driver, given in ((env, state), (vector, [state, state]), (vector, state)):
        before = driver.get_state()
        assert_refused((ValueError, TypeError), ["state"], driver.set_state, given)
        assert driver.get_state() == before


def test_files_of_policies(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    names = ["no.safetensors\0junk", os.fsencode("\udcff"), "/dev/zero", "/"]
    for name in (*names, str(tmp_path / "pipe")):
        assert_refused(ValueError, ["policy ", "it "], _core.Policy, name)
    assert_refused(ValueError, ["must be a regular file"], _core.Policy, str(tmp_path / "pipe"))


def test_policies_check_the_size_of_rows():
    policy = _core.Policy(str(package_file("assets/policies/Walker2d-v5.safetensors")))
    with pytest.raises(ValueError, match="observations has 35 values; must have 17 a row"):
        policy.act(np.zeros(35), np.zeros(12))
    with pytest.raises(ValueError, match="actions has 6 values; must have 12"):
        policy.act(np.zeros((2, 17)), np.zeros(6))
    with pytest.raises(ValueError, match="policy after 7 steps: it has 3 bytes"):
        _core.Policy.from_bytes("after 7 steps", b"abc")
