"""What many walkers have of saved states, whatever the framework."""

from __future__ import annotations

from typing import Sequence

from walker_sim.in_process import InProcessWalkers
from walker_sim.transport import Walkers


def get_states(walkers: Walkers, environments: list[int]) -> list[bytes]:
    """The states of these walkers.

    Raises
    ------
    AttributeError
        Over ROS, where walkers are on a server that tells no state of many.
    RuntimeError
        For a walker that is under way.
    """
    return _in_process(walkers, "get_state").get_states(environments)


def set_states(walkers: Walkers, environments: list[int], states: Sequence[bytes]) -> None:
    """These walkers go on from these states, one for each.

    Raises
    ------
    ValueError, TypeError
        Naming the walker and what its state is of instead, or what of it is damaged. Nothing has
        changed.
    AttributeError, RuntimeError
        As `get_states`.
    """
    pool = _in_process(walkers, "set_state")
    is_one = isinstance(states, (bytes, str)) or not hasattr(states, "__len__")
    if is_one or len(states) != len(environments):
        given = "one state" if is_one else f"{len(states)} states"
        raise ValueError(f"{given}; must be a sequence of {len(environments)}, one for each walker")
    pool.set_states(environments, states)


def _in_process(walkers: Walkers, name: str) -> InProcessWalkers:
    if not isinstance(walkers, InProcessWalkers):
        raise AttributeError(f'{name}: not over ROS; only with transport="inprocess"')
    return walkers
