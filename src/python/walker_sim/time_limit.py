"""Finds the time limit that `gymnasium.make` does not pass to the environment."""

from __future__ import annotations

import sys
from types import FrameType
from typing import Any

import gymnasium
import gymnasium.envs.registration

ANY = -1
"""The limit is unspecified: any limit of the server is accepted."""


def limit_of_make(environment: type[gymnasium.Env]) -> int | None:
    """Returns the time limit of the ``TimeLimit`` that the running `gymnasium.make` will add.

    Over ROS the server ends the episodes, so its limit must equal that of the caller's
    ``TimeLimit``. But `make` uses ``max_episode_steps`` for its wrapper alone: it passes the limit
    neither to the constructor nor to the specification that it stores in the environment. The limit
    is only in the locals of `make`'s frame, whose names are the same since Gymnasium 0.29. If
    another version renames them, the result is None.

    Parameters
    ----------
    environment
        Class, or a base of the class, that is being constructed.

    Returns
    -------
    The limit in steps; 0 for no limit; `ANY` if `make` copies an environment by its own
    specification (``env.unwrapped.spec.make()``), which has no wrappers and so no limit; None if
    `make` does not construct the environment.
    """
    frame: FrameType | None = sys._getframe(1)
    while frame is not None and frame.f_code is not gymnasium.envs.registration.make.__code__:
        frame = frame.f_back
    if frame is None:
        return None
    known = frame.f_locals
    creator = known.get("env_creator")
    if not (isinstance(creator, type) and issubclass(creator, environment)):
        return None  # another environment, which contains a walker
    limit = known.get("max_episode_steps")
    specification: Any = known.get("env_spec")
    if limit is None and specification is not None:
        limit = specification.max_episode_steps
        # make() sets order_enforce to False in the specification that it stores in an environment.
        is_own = known.get("id") is specification and not getattr(
            specification, "order_enforce", True
        )
        if limit is None and is_own:
            return ANY
    return 0 if limit in (None, -1) else limit
