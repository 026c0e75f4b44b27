"""Exceptions of this package, derived from their counterparts in Gymnasium and Python."""

from __future__ import annotations

import builtins

import gymnasium.error


class InvalidAction(gymnasium.error.InvalidAction, ValueError):
    """The action has the wrong shape or a non-finite value. The state is unchanged."""


class ResetNeeded(gymnasium.error.ResetNeeded, RuntimeError):
    """The call needs an episode, and none has begun, its engine failed, or its server was lost; or
    a step needs one that has not ended."""


class ConnectionError(builtins.ConnectionError):
    """The ROS master or the server cannot be reached, or the connection was lost.

    Whether the server has executed the interrupted call is unknown. The next reset reconnects.
    """


class RequestRefused(RuntimeError):
    """The server refused the request; the message is the server's. The state is unchanged."""


class UnknownKeyword(TypeError, ValueError):
    """The environment has no such keyword; the message lists the closest match and all keywords.

    It is a `TypeError`, as Python raises for unknown keywords and TorchRL and others probe for, and
    a `ValueError`, as for every other invalid parameter.
    """


class ServerMismatch(ValueError):
    """The server differs from the requested environment; the message lists the differences."""
