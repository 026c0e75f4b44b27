"""Each script gives each interface over ROS the oracle's trace, to the bit."""

import pytest
from gymnasium_interfaces import SingleWalkers, VectorWalkers
from promises import (
    ALL,
    CASES,
    NUM_WALKERS,
    SCRIPTS,
    check,
    has_states,
    sets_coordinates,
    write_model,
)
from walker_sim import WalkerEnv
from walkers import MODES, make_many


def singles(serve, case, keywords):
    """Returns a function that makes walkers, each with a server of its own."""
    servers = [serve(case.env_id, **keywords)[0] for _ in ALL]

    def make_one(walker):
        return WalkerEnv(case.env_id, transport="ros", server=servers[walker], **keywords)

    return lambda: SingleWalkers(case, make_one, keywords)


def vector(mode, serve, case, keywords):
    """Returns a function that makes a vector environment, all with the same server."""
    server, _ = serve(case.env_id, num_envs=NUM_WALKERS, autoreset_mode=mode, **keywords)
    where = {"transport": "ros", "server": server, "autoreset_mode": mode}
    return lambda: VectorWalkers(
        case, make_many(case.env_id, NUM_WALKERS, **where, **keywords), keywords
    )


# In mode disabled over ROS, no walker can step beside one that could not be reset.
@pytest.mark.parametrize(
    ("mode", "case"),
    [(m, c) for m in ("single", *MODES) for c in CASES if (m, c) != ("disabled", "cramped")],
)
def test_cells(serve, mode, case, tmp_path):
    """A row of cells, by the same servers."""
    case = CASES[case]
    keywords = write_model(case, tmp_path)
    if mode == "single":
        make = singles(serve, case, keywords)
    else:
        make = vector(mode, serve, case, keywords)
    for script in SCRIPTS:
        if mode == "single" or not (has_states(script) or sets_coordinates(script)):
            walkers = make()
            for walker in ALL:
                walkers.set_world(walker, None)  # the server keeps the last one
            check(script, case, walkers)
