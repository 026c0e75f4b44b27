"""Gymnasium's legged walkers, bit for bit, in process and over ROS.

If Gymnasium is installed, importing this package registers ``walker_sim/BipedalWalker-v3``,
``walker_sim/BipedalWalkerHardcore-v3``, ``walker_sim/Walker2d-v4``, ``walker_sim/Walker2d-v5``,
``walker_sim/Hopper-v4`` and ``walker_sim/Hopper-v5``. Without Gymnasium, the package's ROS messages
and services still work.
"""

from __future__ import annotations

import sys

if getattr(sys, "argv", [])[:2] == ["-m", "doctor"]:
    from walker_sim import shadowing

    shadowing.unhide()  # before the imports that a file of the user's may break

import importlib
import importlib.util
import pkgutil
from typing import TYPE_CHECKING, Any

# A ROS workspace and an installed wheel may both be on the path, in either order. The messages come
# from the workspace, the extension module from the one that has it for this Python.
__path__ = pkgutil.extend_path(__path__, __name__)

# Version of the Python files. CMakeLists.txt compares it with package.xml.
__version__ = "1.0.0"

if TYPE_CHECKING:
    from types import ModuleType

    from walker_sim.environment import WalkerEnv as WalkerEnv
    from walker_sim.episode_player import play_out as play_out
    from walker_sim.errors import ConnectionError as ConnectionError
    from walker_sim.errors import InvalidAction as InvalidAction
    from walker_sim.errors import RequestRefused as RequestRefused
    from walker_sim.errors import ResetNeeded as ResetNeeded
    from walker_sim.errors import ServerMismatch as ServerMismatch
    from walker_sim.errors import UnknownKeyword as UnknownKeyword
    from walker_sim.registration import ids as ids
    from walker_sim.vector_environment import WalkerVectorEnv as WalkerVectorEnv
    from walker_sim.worlds import world_parameters as world_parameters
    from walker_sim.worlds import world_presets as world_presets

# Imported on first use: the messages need neither NumPy nor Gymnasium.
_MODULES = {
    **dict.fromkeys(("ConnectionError", "InvalidAction", "RequestRefused"), "errors"),
    **dict.fromkeys(("ResetNeeded", "ServerMismatch", "UnknownKeyword"), "errors"),
    "WalkerEnv": "environment",
    "WalkerVectorEnv": "vector_environment",
    "ids": "registration",
    "play_out": "episode_player",
    **dict.fromkeys(("world_parameters", "world_presets"), "worlds"),
}

__all__ = [*_MODULES, "__version__"]


def _load_core() -> ModuleType:
    """Returns the extension module; ImportError if it is missing or has another version."""
    try:
        core = importlib.import_module("walker_sim._core")
    except ModuleNotFoundError as error:
        if error.name != "walker_sim._core":
            raise
        version = ".".join(map(str, sys.version_info[:2]))
        raise ImportError(
            f"walker_sim has no extension module for this Python, {version} ({sys.executable}), in "
            f"{', '.join(__path__)}. A ROS workspace has only the one for the Python that it was "
            "built with. For this Python: pip install FOLDER, the folder of walker_sim's sources"
        ) from None
    if core.__version__ != __version__:
        globals().pop("_core", None)  # else the next import would skip this check
        files = importlib.util.find_spec("walker_sim.registration")
        raise ImportError(
            f"walker_sim {__version__} ({files and files.origin}) found the extension module of "
            f"walker_sim {core.__version__} ({core.__file__}): two installations are on the path, "
            "and both must have the same version. Install or build one of them anew, or take it "
            "off the path"
        )
    return core


def __getattr__(name: str) -> Any:
    if name == "_core":  # `from walker_sim import _core` looks here first
        return _load_core()
    if name in _MODULES:
        return getattr(importlib.import_module(f"walker_sim.{_MODULES[name]}"), name)
    raise AttributeError(f"module 'walker_sim' has no attribute {name!r}")


if importlib.util.find_spec("gymnasium") is not None:
    try:
        from walker_sim.registration import register_all

        register_all()
    except Exception:
        # `python3 -m walker_sim doctor` reports why Gymnasium cannot be imported.
        if getattr(sys, "argv", [])[:2] != ["-m", "doctor"]:
            raise
