"""The limit that `gymnasium.make` keeps to itself."""

from __future__ import annotations

import sys
from types import FrameType
from typing import Any

import gymnasium
import gymnasium.envs.registration

ANY = -1
"""A limit of which nothing is said."""


def limit_of_make(environment: type[gymnasium.Env]) -> int | None:
    """The time limit that `gymnasium.make` is about to wrap around what it constructs.

    Over ROS the server ends the episodes, so its limit must be that of the caller's ``TimeLimit``.
    But `make` takes ``max_episode_steps`` for its wrapper alone: neither the constructor nor the
    specification that the environment is given afterwards has it. Both are known only while `make`
    runs, in its frame up the stack, whose locals have had the same names since Gymnasium 0.29. A
    version of other names is taken for a call past `make`.

    Parameters
    ----------
    environment
        The class, or a base of it, that is being constructed.

    Returns
    -------
    Steps; 0 where there is to be no limit; `ANY` where `make` copies an environment by its own
    specification (``env.unwrapped.spec.make()``), which knows no wrapper and so no limit; None
    where `make` does not construct the environment.
    """
    frame: FrameType | None = sys._getframe(1)
    while frame is not None and frame.f_code is not gymnasium.envs.registration.make.__code__:
        frame = frame.f_back
    if frame is None:
        return None
    known = frame.f_locals
    creator = known.get("env_creator")
    if not (isinstance(creator, type) and issubclass(creator, environment)):
        return None  # somebody else's environment, which has ours inside
    limit = known.get("max_episode_steps")
    specification: Any = known.get("env_spec")
    if limit is None and specification is not None:
        limit = specification.max_episode_steps
        # Others than an environment's own want the wrapper that refuses steps out of order.
        is_own = known.get("id") is specification and not getattr(
            specification, "order_enforce", True
        )
        if limit is None and is_own:
            return ANY
    return 0 if limit in (None, -1) else limit
