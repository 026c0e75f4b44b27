"""Shared by the server tests: a test case that starts servers, and recorders of topics.

Nothing here waits in simulation time, which stands still in lock-step.
"""

import contextlib
import os
import random
import signal
import struct
import tempfile
import threading
import time
import unittest
import xmlrpc.client

import rosgraph
import roslib.packages
import rospy
from bare_ros import BareSubscriber
from catkin.find_in_workspaces import find_in_workspaces
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from node_processes import ServerProcess
from processes import CALLER, TIMEOUT, LoggedProcess, wait_for
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState, LaserScan
from std_msgs.msg import Float64, Float64MultiArray
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray
from walker_sim.msg import Contacts, Transition, World, WorldParameter

DT = 20_000_000  # ns
FALL = [1.0, 1.0, 1.0, -1.0]  # BipedalWalker falls within 60 steps
STAND = [1.0, 1.0, -1.0, 1.0]  # it stands astride for thousands of steps
# Topics whose messages have the state's stamp; in fast lock-step only /transition has all states.
STATE_TOPICS = {
    "/joint_states": JointState,
    "/scan": LaserScan,
    "/imu": Imu,
    "/contacts": Contacts,
    "/odom": Odometry,
    "/transition": Transition,
    "/tf": TFMessage,
    "/clock": Clock,
}
STATE_VALUES = {"/reward": Float64, "/observation": Float64MultiArray}
MARKERS = {"/scene_markers": MarkerArray, "/state_markers": MarkerArray}


def builtin_model():
    """The MJCF text of Walker2d-v5."""
    path = find_in_workspaces(["share"], "walker_sim", "assets/walker2d_v5.xml")[0]
    with open(path, encoding="utf-8") as file:
        return file.read()


def publishers_of(topic):
    """Names of the nodes that are registered as publishers of the topic."""
    return dict(rosgraph.Master(CALLER).getSystemState()[0]).get(topic, [])


def nanoseconds(stamped):
    """Stamp of a message, a header or a time [ns]."""
    while not hasattr(stamped, "to_nsec"):
        stamped = stamped.header if hasattr(stamped, "header") else stamped.stamp
    return stamped.to_nsec()


def bits(values):
    """Bytes of the doubles, to compare them bitwise, including NaN and -0."""
    return struct.pack(f"<{len(values)}d", *values)


def random_actions(size, count, seed=1):
    draw = random.Random(seed)
    return [[draw.uniform(-1, 1) for _ in range(size)] for _ in range(count)]


def same_experience(one, other):
    """Whether two transitions are bitwise equal, apart from stamps and episode numbers."""
    return (
        one.step == other.step
        and bits(one.action) == bits(other.action)
        and bits(one.observation) == bits(other.observation)
        and bits([one.reward, one.episode_return]) == bits([other.reward, other.episode_return])
        and (one.terminated, one.truncated) == (other.terminated, other.truncated)
        and bits(one.info) == bits(other.info)
        and one.error == other.error
    )


def to_message(world):
    """The message of a preset, or of ranges or values by name."""
    if isinstance(world, str):
        return World(preset=world)
    parameters = []
    for name, given in world.items():
        is_log = isinstance(given, dict)
        ends = given["log"] if is_log else given
        low, high = ends if isinstance(ends, (list, tuple)) else (ends, ends)
        parameters.append(WorldParameter(name, low, high, is_log))
    return World("", parameters)


def values_of(parameters):
    """What an episode has drawn, as `info["world"]` in Python."""
    drawn = {}
    for each in parameters:
        ends = each.low, each.high
        drawn[each.name] = {"log": ends} if each.log_uniform else ends
        if each.low == each.high:
            drawn[each.name] = each.low
    return drawn


class Bytes(Float64MultiArray):
    """An effort command with arbitrary bytes on the wire."""

    def __init__(self, data=b""):
        super().__init__()
        self.bytes = data

    def serialize(self, buffer):
        buffer.write(self.bytes)


class Recorder:
    def __init__(self, topic, message_class, waits=True):
        """@param waits: whether to wait for the publishers that the master knows, at least one"""
        self.topic = topic
        self._changed = threading.Condition()
        self._messages = []
        self._subscriber = rospy.Subscriber(
            topic, message_class, self._record, queue_size=None, tcp_nodelay=True
        )
        if waits:
            wait_for(self._is_heard_by_all, f"the publishers of {topic}")

    def _is_heard_by_all(self):
        """Whether all publishers report the connection, which they may do later than rospy."""
        links = list(self._subscriber.impl.connections)
        ports = {one.endpoint_id: one.socket.getsockname()[1] for one in links if one.socket}
        reports = []
        for node in publishers_of(self.topic):
            uri = rospy.get_master().lookupNode(node)[2]
            try:
                infos = xmlrpc.client.ServerProxy(uri).getBusInfo(CALLER)[2]
            except OSError:  # a killed node remains registered
                continue
            reports.append(any(f":{ports.get(uri)} on socket" in info[-1] for info in infos))
        return reports and all(reports)

    def _record(self, message):
        with self._changed:
            self._messages.append(message)
            self._changed.notify_all()

    def messages(self):
        with self._changed:
            return list(self._messages)

    def stamps(self):
        """Stamps of the messages so far [ns]."""
        return [first_stamp(message) for message in self.messages()]

    def clear(self):
        with self._changed:
            self._messages = []

    def wait(self, condition=lambda _: True, what="a message", timeout=TIMEOUT):
        """Returns the first message, past or future, that meets the condition."""
        deadline = time.monotonic() + timeout
        examined, count = None, 0
        with self._changed:
            while True:
                if examined is not self._messages:  # clear() was called
                    examined, count = self._messages, 0
                for message in examined[count:]:
                    if condition(message):
                        return message
                count = len(examined)
                left = deadline - time.monotonic()
                if left <= 0:
                    raise AssertionError(
                        f"timed out after {timeout} s waiting for {what} on {self.topic}"
                    )
                self._changed.wait(left)

    def at(self, stamp):
        """Waits for the message with this stamp [ns]."""
        return self.wait(lambda m: first_stamp(m) == stamp, f"the stamp {stamp}")

    def wait_count(self, count, timeout=TIMEOUT):
        wait_for(
            lambda: len(self.messages()) >= count, f"{count} messages on {self.topic}", timeout
        )
        return self.messages()

    def close(self):
        self._subscriber.unregister()


def first_stamp(message):
    if hasattr(message, "transforms"):
        return nanoseconds(message.transforms[0])
    if hasattr(message, "clock"):
        return message.clock.to_nsec()
    return nanoseconds(message)


def write_model(test, text):
    """Writes a model file, which the test removes at its end. Returns the path."""
    folder = tempfile.TemporaryDirectory()
    test.addCleanup(folder.cleanup)
    path = os.path.join(folder.name, "my walker.xml")
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
    return path


class ServerTest(unittest.TestCase):
    """Starts servers, and ends them after the test."""

    dt = DT  # of the environment [ns]
    server = None

    @contextlib.contextmanager
    def subTest(self, message="", **parameters):
        """Ends the test at the first failure and names it: rosunit does not report subtests."""
        try:
            yield
        except Exception as error:
            texts = [message, *(f"{name}={value!r}" for name, value in parameters.items())]
            raise AssertionError(f"{' '.join(filter(None, texts))}: {error}") from error

    def start(self, name, master_uri=None, **parameters):
        """Starts a server without waiting for it."""
        server = ServerProcess(name, parameters, master_uri)
        self.addCleanup(server.end)
        return server

    def serve(self, name="/walker_sim", master_uri=None, **parameters):
        """Starts a server, to which `client` and `call` then refer; first ends its namesake."""
        if self.server and self.server.name == name:
            self.server.stop()
        parameters.setdefault("diagnostic_period", 0.05)
        self.server = self.start(name, master_uri, **parameters)
        return self.server.wait_until_it_serves()

    def client(self, service, service_class=None, **options):
        """Connects to a service until the end of the test."""
        client = self.server.client(service, service_class, **options)
        self.addCleanup(client.close)
        return client

    def subscribe(self, topic, kind):
        """Subscribes to the server on a plain socket until the end of the test."""
        subscriber = BareSubscriber(self.server.uri(), topic, kind)
        self.addCleanup(subscriber.close)
        return subscriber

    def record(self, topic, kind, waits=True):
        recorder = Recorder(topic, kind, waits)
        self.addCleanup(recorder.close)
        return recorder

    def commander(self, message_class=Float64MultiArray):
        """Returns a publisher of effort commands to which the server has subscribed."""
        publisher = rospy.Publisher("/effort_command", message_class, queue_size=10)
        self.addCleanup(publisher.unregister)
        wait_for(lambda: publisher.get_num_connections() >= 1, "the server's subscription")
        return publisher

    def begin_stepping(self):
        """Connects `self.reset` and `self.step`, and begins an episode."""
        self.reset, self.step = self.client("reset"), self.client("step")
        self.last = self.reset(has_seed=True, seed=1).transition

    def assert_serves(self, steps=3, action=STAND):
        """Steps with `self.step`; no other client has stepped since `self.last`."""
        for _ in range(steps):
            reply = self.step(action=action)
            self.assertTrue(reply.success, reply.status_message)
            self.assertEqual(reply.transition.step, self.last.step + 1)
            self.last = reply.transition

    def play(self, actions):
        """Steps, up to the end of the episode. Returns the transitions."""
        transitions = []
        with contextlib.closing(self.server.client("step")) as step:
            for action in actions:
                reply = step(action=action)
                self.assertTrue(reply.success, reply)
                transitions.append(reply.transition)
                if reply.transition.terminated or reply.transition.truncated:
                    break
        return transitions

    def start_recorder(self, bag, *topics):
        """Runs `rosbag record` as node /recorder."""
        program = roslib.packages.find_node("rosbag", "record")[0]
        command = [program, f"--output-name={bag}", *topics, "__name:=recorder"]
        recorder = LoggedProcess(command)
        self.addCleanup(recorder.kill)
        return recorder

    def stop_recorder(self, recorder):
        time.sleep(0.5)  # rosbag does not report what it has received
        self.assertEqual(recorder.end(signal.SIGINT), 0, recorder.output())

    def call(self, name, **fields):
        with contextlib.closing(self.server.client(name)) as client:
            return client(**fields)

    def ask(self, name, **fields):
        """Returns the response of a call that must succeed."""
        response = self.call(name, **fields)
        self.assertTrue(response.success, response)
        return response

    def model_file(self, *replacements):
        """Writes Walker2d-v5's model with these replacements. Returns the path."""
        text = builtin_model()
        for old, new in replacements:
            self.assertIn(old, text)
            text = text.replace(old, new)
        return write_model(self, text)

    def cramped_walker(self):
        """Parameters of a Walker2d-v5 whose MuJoCo stack overflows in resets with some seeds."""
        return {
            "env": "Walker2d-v5",
            "xml_file": self.model_file(('nstack="8000"', 'nstack="520"')),
            "terminate_when_unhealthy": False,
            "reset_noise_scale": 3.0,
        }

    def counter(self, word):
        """Value in new diagnostics of the first key that contains `word`."""
        if not hasattr(self, "_diagnostics"):
            self._diagnostics = self.record("/diagnostics", DiagnosticArray)
        self._diagnostics.clear()
        for _ in range(2):  # the first may be older than this call
            message = self._diagnostics.wait(lambda m: diagnostic_values(m, word), f"{word} in it")
            self._diagnostics.clear()
        return float(diagnostic_values(message, word)[0])

    def assert_same_experiences(self, ones, others):
        self.assertEqual(len(ones), len(others))
        for one, other in zip(ones, others):
            self.assertTrue(same_experience(one, other), f"{one}\n{other}")

    def assert_grows(self, stamps):
        self.assertGreater(stamps[0], 0)
        for one, other in zip(stamps, stamps[1:]):
            self.assertLess(one, other)

    def assert_consecutive(self, transitions):
        """Consecutive stamps differ by dt, within an episode and across resets."""
        self.assertGreater(len(transitions), 1)
        for one, other in zip(transitions, transitions[1:]):
            self.assertEqual(nanoseconds(other), nanoseconds(one) + self.dt)
            if one.terminated or one.truncated:
                self.assertEqual((other.episode, other.step), (one.episode + 1, 0))
                self.assertEqual(list(other.action), [])
                self.assertEqual((other.reward, other.episode_return), (0, 0))
            else:
                self.assertEqual((other.episode, other.step), (one.episode, one.step + 1))


class TransitionsTest(ServerTest):
    """Records the transitions of its servers."""

    def serve(self, *arguments, **parameters):
        super().serve(*arguments, **parameters)
        self.transitions = self.record("/transition", Transition)
        return self.server


def recorded_topics(server):
    """Topics of the server to which the node /recorder subscribes."""
    connections = xmlrpc.client.ServerProxy(server.uri()).getBusInfo(CALLER)[2]
    return {info[4] for info in connections if info[1] == "/recorder"}


def statuses(message, task):
    """Statuses of this task in diagnostics."""
    return [status for status in message.status if status.name.endswith(f": {task}")]


def diagnostic_values(message, word):
    return [pair.value for status in message.status for pair in status.values if word in pair.key]
