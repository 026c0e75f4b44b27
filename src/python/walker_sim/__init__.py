"""Gymnasium's bipedal walkers with the same bits, in process and over ROS.

Importing this registers ``walker_sim/BipedalWalker-v3``, ``walker_sim/BipedalWalkerHardcore-v3``,
``walker_sim/Walker2d-v4`` and ``walker_sim/Walker2d-v5`` with Gymnasium, where that is installed.
Where it is not, the ROS messages and services of this package are there all the same.
"""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
from typing import TYPE_CHECKING, Any

# A ROS workspace and an installed wheel may both be in sight, in either order: the messages come
# from the one, the extension module from whichever has it for this Python.
__path__ = pkgutil.extend_path(__path__, __name__)

__version__ = "0.1.0"

if TYPE_CHECKING:
    from walker_sim.environment import WalkerEnv
    from walker_sim.errors import (
        ConnectionError,
        InvalidAction,
        RequestRefused,
        ResetNeeded,
        ServerMismatch,
    )
    from walker_sim.registration import ids
    from walker_sim.vector_environment import WalkerVectorEnv

# Looked up when first used: who wants the messages needs neither NumPy nor Gymnasium.
_HOMES = {
    "ConnectionError": "errors",
    "InvalidAction": "errors",
    "RequestRefused": "errors",
    "ResetNeeded": "errors",
    "ServerMismatch": "errors",
    "WalkerEnv": "environment",
    "WalkerVectorEnv": "vector_environment",
    "ids": "registration",
}

__all__ = [
    "ConnectionError",
    "InvalidAction",
    "RequestRefused",
    "ResetNeeded",
    "ServerMismatch",
    "WalkerEnv",
    "WalkerVectorEnv",
    "__version__",
    "ids",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(importlib.import_module(f"walker_sim.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'walker_sim' has no attribute {name!r}")


if importlib.util.find_spec("gymnasium") is not None:
    from walker_sim.registration import register_all

    register_all()
