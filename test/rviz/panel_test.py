"""The panel and the tool of rviz, by clicks on a virtual screen: what the server then does."""

import contextlib
import os
import signal
import time
import xmlrpc.client

import pytest
import rosgraph
import rosnode
import rospy
from geometry_msgs.msg import WrenchStamped
from hand import Hand, trunk_of, trunk_pixel
from stage import Stage, wait_for
from walker_sim.msg import Episode, Transition, World, WorldParameter
from walker_sim.srv import SetWorld, Snapshot

# Colours of the buttons' icons, as in walker_panel.cpp.
RESET, PAUSE, STEP = (20, 120, 110), (200, 110, 0), (90, 70, 170)
FRICTION = 0.75  # of the world of the launch


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


@pytest.fixture(name="show", params=[("BipedalWalker-v3", ""), ("Walker2d-v5", "second")])
def fixture_show(stage, request):
    env, space = request.param
    arguments = [f"world:={{friction_scale: {FRICTION}}}"]
    with stage.show(env, mode="free", ns=space, arguments=arguments) as show:
        show.env = env
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


def uri_of_server(show):
    return rospy.get_master().lookupNode(f"{show.space}/walker_sim")[2]


def server_hears_pushes(show):
    links = xmlrpc.client.ServerProxy(uri_of_server(show)).getBusInfo("/stage")[2]
    topic = f"{show.space}/push"
    return any(link[2] == "i" and link[4] == topic and link[5] for link in links)


def world_of(messages):
    """Returns the numbers that the newest episode has drawn, by name."""
    return {each.name: pytest.approx(each.low) for each in messages[-1].world}


def test_panel(show):
    hand = Hand(show.screen)
    transitions = Heard(f"{show.space}/transition", Transition)
    with transitions as steps, Heard(f"{show.space}/episode", Episode) as episodes:
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
        assert episodes.messages[-1].has_seed
        assert world_of(episodes.messages) == {"friction_scale": FRICTION}
        # A preset of the world, by the keyboard from the last button on.
        hand.press(STEP)
        hand.do("key", "Tab", "Tab")
        hand.do("type", "moon")
        hand.press(RESET)
        wait_for(lambda: world_of(episodes.messages) == {"gravity": -1.62}, "the world")
        # Its slider.
        hand.press(STEP)
        hand.do("key", "Tab", "Tab", "Tab", "Left", "Left", "Left")
        hand.press(RESET)
        wait_for(lambda: world_of(episodes.messages) != {"gravity": -1.62}, "the slider")
        assert -1.8 < episodes.messages[-1].world[0].low < -1.62
        # The world of the launch.
        hand.press(STEP)
        hand.do("key", "Tab", "Tab", "Home")
        hand.press(RESET)
        own = {"friction_scale": FRICTION}
        wait_for(lambda: world_of(episodes.messages) == own, "the server's own world")
        # One that somebody else has set. The panel looks every second, later on a busy machine.
        world = World("", [WorldParameter("gravity", -3, -3, False), *episodes.messages[-1].world])
        for seconds in (2, 4, 8, 16):
            assert show.service("set_world", SetWorld)(worlds=[world]).success
            time.sleep(seconds)
            hand.press(STEP)
            # The first slider, by name.
            hand.do("key", "Tab", "Tab", "Tab", "Left", "Left", "Left")
            before = episodes.messages[-1]
            hand.press(RESET)
            wait_for(lambda before=before: episodes.messages[-1] is not before, "the reset")
            if "gravity" in world_of(episodes.messages):
                break
        friction, gravity = (each.low for each in episodes.messages[-1].world)
        assert 0.9 * FRICTION < friction < FRICTION and gravity == -3
        # The button that paused runs now.
        hand.press(PAUSE)
        wait_for(lambda: not stands_still(steps.messages), "the run")
    # Without a server the panel says so, and rviz stays alive.
    os.kill(xmlrpc.client.ServerProxy(uri_of_server(show)).getPid("/stage")[2], signal.SIGKILL)
    wait_for(lambda: hand.find(RESET) is None, "the panel to say that the server is gone")
    # The master keeps a killed node's registrations, to which the next test would wait to connect.
    rosnode.cleanup_master_blacklist(rosgraph.Master("/stage"), [f"{show.space}/walker_sim"])


def test_tool(show):
    hand = Hand(show.screen)
    transitions = Heard(f"{show.space}/transition", Transition)
    with transitions as steps, Heard(f"{show.space}/push", WrenchStamped) as pushes:
        pause_at_the_beginning(hand, steps.messages)
        column, row = trunk_pixel(show, show.env, steps.messages[-1].header.stamp)
        left, upper, _, _ = show.picture_box()
        # A drag that begins on the trunk pushes it.
        hand.click((left + 30, upper + 30))
        hand.do("key", "u")
        wait_for(lambda: server_hears_pushes(show), "the server to hear the tool")
        hand.do("mousemove", column, row, "mousedown", 1)
        hand.do("mousemove", column + 40, row, "mousemove", column + 80, row)
        wait_for(lambda: pushes.messages, "a push")
        frame = f"{show.space}/{trunk_of(show.env)[1]}".lstrip("/")
        assert {push.header.frame_id for push in pushes.messages} == {frame}
        action = [0.0] * show.spec.action_size
        time.sleep(0.5)  # the tool publishes with every picture
        show.step(action)
        time.sleep(0.5)  # and after the step
        hand.do("mouseup", 1)
        # Released in a pause, the push does not act in the next step.
        wait_for(lambda: stands_still(pushes.messages), "the end of the pushes")
        show.step(action)
        (push,) = show.service("snapshot", Snapshot)().record.pushes
        assert push.link == 0
        assert push.force_x > 10
        assert abs(push.force_z) < push.force_x / 3
        # A drag beside it moves the camera and pushes nothing.
        count = len(pushes.messages)
        hand.do("mousemove", left + 30, upper + 30, "mousedown", 1)
        hand.do("mousemove", left + 60, upper + 40, "mouseup", 1)
        time.sleep(0.5)
        assert len(pushes.messages) == count
