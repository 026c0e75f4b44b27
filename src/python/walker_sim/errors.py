"""What can go wrong, each as a kind of what Gymnasium or Python have for it."""

from __future__ import annotations

import builtins

import gymnasium.error


class InvalidAction(gymnasium.error.InvalidAction, ValueError):
    """The action has the wrong size or is not finite. Nothing has moved."""


class ResetNeeded(gymnasium.error.ResetNeeded, RuntimeError):
    """A step without a running episode: before the first reset, or after the end."""


class ConnectionError(builtins.ConnectionError):
    """The ROS master or the server cannot be reached, or the connection broke.

    Whether a call under way was made is not known. The next reset connects anew.
    """


class RequestRefused(RuntimeError):
    """The server refused, in its own words. Nothing has moved."""


class UnknownKeyword(TypeError, ValueError):
    """A keyword that the environment does not have; the message names the nearest one and all.

    A `TypeError` as Python's own, by which TorchRL and others probe, and a `ValueError` as for all
    other parameters.
    """


class ServerMismatch(ValueError):
    """The server runs something else than what was asked for; the message lists the differences."""
