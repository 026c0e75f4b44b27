"""Puts the helpers beside it on the path of every suite below, and lends them the rollout tool."""

import pytest
from rollout_tool import Rollout


@pytest.fixture()
def rollout():
    tool = Rollout()
    yield tool
    tool.close()
