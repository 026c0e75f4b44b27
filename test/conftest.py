"""Puts this folder's helper modules on sys.path and provides the fixture `rollout`."""

import pytest
from rollout_tool import Rollout


@pytest.fixture()
def rollout():
    tool = Rollout()
    yield tool
    tool.close()
