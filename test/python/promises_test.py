"""Each script gives each interface in process the oracle's trace, to the bit."""

import copy
import functools

import pytest
from gymnasium_interfaces import (
    AsynchronousWalkers,
    PartsOfWalkers,
    SingleWalkers,
    VectorWalkers,
)
from promises import (
    CASES,
    NUM_WALKERS,
    SCRIPTS,
    check,
    has_states,
    oracle,
    play,
    sets_coordinates,
    write_model,
)
from walker_sim import WalkerEnv
from walkers import MODES, make_many, make_ours, restored, through_pickle


def singles(make, case, keywords, copied=None):
    return SingleWalkers(case, lambda _: make(case.env_id, **keywords), keywords, copied)


def vector(mode, case, keywords, copied=None):
    envs = make_many(case.env_id, NUM_WALKERS, autoreset_mode=mode, **keywords)
    return VectorWalkers(case, envs, keywords, copied)


def parts(kind, mode, batch_size, case, keywords):
    options = {"autoreset_mode": mode, "batch_size": batch_size, "num_threads": 2, **keywords}
    return kind(case, make_many(case.env_id, NUM_WALKERS, **options), keywords)


INTERFACES = {
    "WalkerEnv": functools.partial(singles, WalkerEnv),
    "WalkerEnv_restored": functools.partial(singles, WalkerEnv, copied=restored),
    "WalkerEnv_deepcopy": functools.partial(singles, WalkerEnv, copied=copy.deepcopy),
    # Gymnasium's checker compares a reset with one that raised, which has no result.
    "make_pickle": functools.partial(
        singles,
        functools.partial(make_ours, disable_env_checker=True),
        copied=through_pickle,
    ),
    **{f"make_vec_{mode}": functools.partial(vector, mode) for mode in MODES},
    "make_vec_pickle": functools.partial(vector, "same_step", copied=through_pickle),
    "make_vec_deepcopy": functools.partial(vector, MODES[0], copied=copy.deepcopy),
    **{
        f"{name}_{mode}": functools.partial(parts, kind, mode, batch_size)
        for mode in MODES[:2]
        for name, kind, batch_size in (
            ("step_some", PartsOfWalkers, NUM_WALKERS),
            ("send_recv", AsynchronousWalkers, 1),
        )
    },
}
SINGLES = ("WalkerEnv", "WalkerEnv_restored", "WalkerEnv_deepcopy", "make_pickle")
CELLS = [
    (interface, case, script)
    for interface in INTERFACES
    for case in CASES
    for script in SCRIPTS
    # Its states do not include the step count of Gymnasium's TimeLimit.
    if (interface != "make_pickle" or not has_states(script))
    and (interface in SINGLES or not sets_coordinates(script))
]


@pytest.mark.parametrize(("interface", "case", "script"), CELLS)
def test_cell(interface, case, script, tmp_path):
    case = CASES[case]
    check(script, case, INTERFACES[interface](case, write_model(case, tmp_path)))


@pytest.mark.parametrize(
    ("script", "number", "changed"),
    [
        ("episodes_equal_the_robots", 0, {"argument": "6"}),
        ("generators_continue", 4, {"walkers": [0, 1]}),
        ("worlds_stand_beside_each_other", 0, {"argument": "gymnasium"}),
        ("a_world_acts_from_the_next_reset", 2, {"walkers": [2]}),
        ("drawn_numbers_repeat_an_episode", 2, {"argument": "moon"}),
        ("a_saved_state_continues", 6, {"walkers": [1]}),
        ("a_saved_level_replaces_another", 6, {"walkers": [2]}),
        ("a_saved_state_replaces_another_world", 7, {"argument": "plain"}),
        ("a_refused_call_changes_nothing", 5, {"name": "world", "argument": "moon"}),
        ("a_refused_state_changes_nothing", 4, {"name": "load", "argument": "begun"}),
    ],
)
@pytest.mark.parametrize("mode", MODES)
def test_the_oracle_notices_a_change(mode, script, number, changed):
    """A wrong seed, a lost world, a state in the wrong walker, a refused call that acted."""
    case = CASES["Hopper_v5"]
    calls = [*SCRIPTS[script]]
    calls[number] = calls[number]._replace(**changed)
    interface = vector(mode, case, dict(case.parameters))
    assert play(calls, case, interface) != oracle(case.name, interface.resets_at_once)[script]
