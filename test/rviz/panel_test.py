"""The panel and the tool of rviz, by clicks on a virtual screen: what the server then does."""

import contextlib
import os
import signal
import time
import xmlrpc.client

import pytest
import rospy
from geometry_msgs.msg import WrenchStamped
from hand import Hand, trunk_of, trunk_pixel
from stage import Stage, wait_for
from walker_sim.msg import Episode, Transition
from walker_sim.srv import GetSpec, Snapshot

# Colours of the buttons' icons, as in walker_panel.cpp.
RESET, PAUSE, STEP = (20, 120, 110), (200, 110, 0), (90, 70, 170)


class Heard(contextlib.AbstractContextManager):
    """The messages of a topic within a context."""

    def __init__(self, topic, kind):
        self.messages = []
        self._subscriber = rospy.Subscriber(topic, kind, self.messages.append, tcp_nodelay=True)

    def __exit__(self, *error):
        self._subscriber.unregister()


@pytest.fixture(name="stage", scope="module")
def fixture_stage():
    stage = Stage()
    yield stage
    stage.close()


@pytest.fixture(name="show", params=["BipedalWalker-v3", "Walker2d-v5"])
def fixture_show(stage, request):
    with stage.show(request.param, mode="free") as show:
        show.env = request.param
        yield show


def stands_still(transitions):
    count = len(transitions)
    time.sleep(0.5)
    return len(transitions) == count


def pause_at_the_beginning(hand, transitions):
    wait_for(lambda: transitions, "steps")
    hand.press(PAUSE)
    wait_for(lambda: stands_still(transitions), "the pause")
    hand.press(RESET)
    wait_for(lambda: transitions[-1].step == 0, "the reset")


def server_hears_pushes():
    uri = rospy.get_master().lookupNode("/walker_sim")[2]
    links = xmlrpc.client.ServerProxy(uri).getBusInfo("/stage")[2]
    return any(link[2] == "i" and link[4] == "/push" and link[5] for link in links)


def test_panel(show):
    hand = Hand(show.screen)
    with Heard("/transition", Transition) as steps, Heard("/episode", Episode) as episodes:
        pause_at_the_beginning(hand, steps.messages)
        # One click is one step.
        for _ in range(3):
            before = steps.messages[-1]
            hand.press(STEP)
            wait_for(lambda before=before: steps.messages[-1] is not before, "the step")
            assert stands_still(steps.messages)
            assert steps.messages[-1].step == before.step + 1
        # A reset with a seed.
        column, row = hand.find(RESET)
        hand.click((column - 60, row))
        hand.do("type", "42")
        hand.press(RESET)
        wait_for(lambda: episodes.messages[-1].seed == 42, "the seed")
        assert episodes.messages[-1].has_seed and not episodes.messages[-1].world
        # A preset of the world, by the keyboard from the last button on.
        hand.press(STEP)
        hand.do("key", "Tab", "Tab")
        hand.do("type", "moon")
        hand.press(RESET)
        wait_for(lambda: episodes.messages[-1].world, "the world")
        (gravity,) = episodes.messages[-1].world
        assert (gravity.name, gravity.low) == ("gravity", pytest.approx(-1.62))
        # Its slider.
        hand.press(STEP)
        hand.do("key", "Tab", "Tab", "Tab", "Left", "Left", "Left")
        hand.press(RESET)
        wait_for(lambda: episodes.messages[-1].world[0].low != gravity.low, "the slider")
        assert -1.8 < episodes.messages[-1].world[0].low < -1.62
        # The button that paused runs now.
        hand.press(PAUSE)
        wait_for(lambda: not stands_still(steps.messages), "the run")
    # Without a server the panel says so, and rviz stays alive.
    uri = rospy.get_master().lookupNode("/walker_sim")[2]
    os.kill(xmlrpc.client.ServerProxy(uri).getPid("/stage")[2], signal.SIGKILL)
    wait_for(lambda: hand.find(RESET) is None, "the panel to say that the server is gone")


def test_tool(show):
    hand = Hand(show.screen)
    with Heard("/transition", Transition) as steps, Heard("/push", WrenchStamped) as pushes:
        pause_at_the_beginning(hand, steps.messages)
        column, row = trunk_pixel(show, show.env, steps.messages[-1].header.stamp)
        left, upper, _, _ = show.picture_box()
        # A drag that begins on the trunk pushes it.
        hand.click((left + 30, upper + 30))
        hand.do("key", "u")
        wait_for(server_hears_pushes, "the server to hear the tool")
        hand.do("mousemove", column, row, "mousedown", 1)
        hand.do("mousemove", column + 40, row, "mousemove", column + 80, row)
        wait_for(lambda: pushes.messages, "a push")
        assert {push.header.frame_id for push in pushes.messages} == {trunk_of(show.env)[1]}
        spec = rospy.ServiceProxy("/walker_sim/get_spec", GetSpec)().spec
        time.sleep(0.5)  # the tool publishes with every picture
        show.step([0.0] * spec.action_size)
        (push,) = rospy.ServiceProxy("/walker_sim/snapshot", Snapshot)().record.pushes
        hand.do("mouseup", 1)
        assert push.link == 0
        assert push.force_x > 10
        assert abs(push.force_z) < push.force_x / 3
        # A drag beside it moves the camera and pushes nothing.
        wait_for(lambda: stands_still(pushes.messages), "the end of the pushes")
        count = len(pushes.messages)
        hand.do("mousemove", left + 30, upper + 30, "mousedown", 1)
        hand.do("mousemove", left + 60, upper + 40, "mouseup", 1)
        time.sleep(0.5)
        assert len(pushes.messages) == count
