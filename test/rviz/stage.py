"""A walker in rviz on a virtual screen, for the test and the animations.

All processes end with the stage. The stage does not use the machine's display, its ROS master or
its settings of rviz.
"""

import contextlib
import functools
import os
import pathlib
import re
import signal
import subprocess
import sys
import threading
import time
import xmlrpc.client

import numpy as np
import rospy
from PIL import ImageGrab
from tf2_msgs.msg import TFMessage
from walker_sim._core import Agent, Policy
from walker_sim.commands.policies import acting, shipped_policy
from walker_sim.srv import GetSpec, Reset, Step

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1]))
import processes
from processes import Master, Processes, start_screen

TIMEOUT = 60.0  # [s]; only a failing test waits that long
wait_for = functools.partial(processes.wait_for, timeout=TIMEOUT)
# In some of 100 starts on a busy machine, Mesa's software renderer crashes rviz while it compiles
# its first shaders. Either libLLVM segfaults, called by swrast in a buffer swap, with none of our
# code on the stack, or the C library detects heap corruption in a process with none of our code.
# rviz is then restarted before any check.
MAX_STARTS = 3
CRASH_OF_RVIZ = re.compile(
    r"\[rviz-\d+\] process has died \[pid \d+, exit code -11,"
    r"|^malloc\(\): .*\n.*\[rviz-\d+\] process has died \[pid \d+, exit code -6,",
    re.MULTILINE,
)


class Screen:
    def __init__(self, processes, width, height):
        self.display = start_screen(processes.start, f"{width}x{height}")
        self._environment = {**os.environ, "DISPLAY": self.display}

    def grab(self, box=None):
        """Returns a picture of the screen, or of its box (left, upper, right, lower)."""
        return ImageGrab.grab(box, xdisplay=self.display)

    def render_window(self):
        """Returns the box (left, upper, right, lower) where rviz draws; None without such a window.

        OpenGL draws in unnamed windows below those of rviz's toolkit; the windows of closed panels
        are not viewable.
        """
        _, begin, tree = self._ask_windows("-root", "-tree").partition(' - RViz": (')
        window = r"^ +(0x[0-9a-f]+) \(has no name\): \(\)  (\d+)x(\d+)\S+  \+(-?\d+)\+(-?\d+)$"
        for found in re.finditer(window, tree if begin else "", re.MULTILINE):
            width, height, left, upper = map(int, found.groups()[1:])
            is_seen = "Map State: IsViewable" in self._ask_windows("-id", found[1])
            if is_seen and min(width, height) > 1:
                return left, upper, left + width, upper + height
        return None

    def _ask_windows(self, *arguments):
        done = subprocess.run(
            ["xwininfo", *arguments],
            env=self._environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,  # a window may have closed meanwhile
            encoding="utf-8",
            errors="replace",
            check=False,
        )
        return done.stdout


class Stage:
    """A screen and a ROS master that show one walker after another.

    Only one per process, because rospy supports a single master.
    """

    def __init__(self, width=1360, height=860):
        self._master = Master(exports=True)
        self.close = self._master.close
        try:
            self._begin(width, height)
        except BaseException:
            self.close()
            raise

    def _begin(self, width, height):
        self.screen = Screen(self._master, width, height)
        folder = os.environ["ROS_HOME"]
        os.environ.update(
            HOME=folder,  # rviz stores its settings there
            XDG_RUNTIME_DIR=folder,
            DISPLAY=self.screen.display,
            QT_QPA_PLATFORM="xcb",
            ROSCONSOLE_FORMAT="[${severity}] [${node}]: ${message}",
        )
        os.environ.pop("WAYLAND_DISPLAY", None)
        rospy.init_node("stage", disable_signals=True, disable_rostime=True)
        self._transforms = {"/tf": {}, "/tf_static": {}}
        self._changed = threading.Condition()
        for topic in self._transforms:
            rospy.Subscriber(topic, TFMessage, self._take_transforms, topic, tcp_nodelay=True)

    @contextlib.contextmanager
    def show(self, env, agent="shipped", mode="lockstep", ns="", arguments=()):
        """Runs walker.launch with rviz and these further arguments within the context, in the
        namespace `ns`. `walk` takes actions of `agent`: shipped or robust, which are networks, or
        heuristic, the shipped gait."""
        with self._changed:
            for of_topic in self._transforms.values():
                of_topic.clear()
        # SIGTERM ends rviz while the master still has its registrations.
        with Processes(by=signal.SIGINT) as processes:
            if ns:
                arguments = [f"ns:={ns}", "publish_clock:=true", *arguments]
            arguments = [f"mode:={mode}", *arguments]
            yield Show(self, processes, env, agent, f"/{ns}" if ns else "", arguments)

    def _take_transforms(self, message, topic):
        """Stores the transforms by their frames' names without a prefix."""
        with self._changed:
            for transform in message.transforms:
                transform.header.frame_id = transform.header.frame_id.rpartition("/")[2]
                self._transforms[topic][transform.child_frame_id.rpartition("/")[2]] = transform
            self._changed.notify_all()

    def transforms(self):
        with self._changed:
            return [dict(of_topic) for of_topic in self._transforms.values()]


class NodeHasEnded(AssertionError):
    """A node of the launch has ended."""


class Show:
    """`space` is the namespace with a leading slash, or empty."""

    def __init__(self, stage, processes, env, agent, space, arguments):
        self.screen, self._stage, self._processes = stage.screen, stage, processes
        self.space = space
        arguments = [f"env:={env}", "rviz:=true", "status:=false", *arguments]
        for left in reversed(range(MAX_STARTS)):
            self._started = []
            self._launch = self.start(["roslaunch", "walker_sim", "walker.launch", *arguments])
            try:
                wait_for(self._alive_and(self._all_are_connected), "rviz to connect")
                self.picture_box()
                break
            except NodeHasEnded:
                if left == 0 or not CRASH_OF_RVIZ.search(self.log()):
                    raise
                print(f"rviz has ended at its start, and is started again:\n{self.log()}")
                processes.close()
        self._agent, self._env = agent, env
        self.spec = self.service("get_spec", GetSpec)().spec
        self._num_actions = self.spec.action_size
        self._reset = self.service("reset", Reset)
        self._step = self.service("step", Step)

    def service(self, name, kind):
        return rospy.ServiceProxy(f"{self.space}/walker_sim/{name}", kind, persistent=True)

    def _all_are_connected(self):
        """Whether rviz and this process receive everything that is published from now on."""
        publishers, subscribers, _ = rospy.get_master().getSystemState()[2]
        of_walker = (f"{self.space}/scene_markers", f"{self.space}/state_markers")
        topics = ("/tf", "/tf_static", *of_walker)
        hearers = {topic: nodes for topic, nodes in subscribers if topic in topics}
        if any(f"{self.space}/rviz" not in hearers.get(topic, ()) for topic in topics):
            return False
        for topic, nodes in publishers:
            for node in nodes:
                uri = rospy.get_master().lookupNode(node)[2]
                try:
                    links = xmlrpc.client.ServerProxy(uri).getBusInfo("/stage")[2]
                except OSError:  # the node has ended without unregistering
                    return False
                reached = {link[1] for link in links if link[2] == "o" and link[4] == topic}
                if not reached.issuperset(hearers.get(topic, ())):
                    return False
        return True

    def reset(self, seed):
        if self._agent in ("shipped", "robust"):
            agent = Policy(str(shipped_policy(self._env, self._agent)))
        else:
            agent = Agent(self._agent, self._env, {}, 0)
        self._act = acting(agent, self._num_actions)  # without earlier state
        return self._checked(self._reset(has_seed=True, seed=seed))

    def walk(self, transition):
        return self.step(self._act(np.array(transition.observation)).tolist())

    def step(self, action):
        return self._checked(self._step(action=action))

    @staticmethod
    def _checked(answer):
        assert answer.success, answer.status_message
        return answer.transition

    def transforms_at(self, stamp, frames):
        """Returns the transforms from odom to these frames at this time, by frame."""

        def chains():
            moving, fixed = self._stage.transforms()
            found = {}
            for frame in frames:
                while frame != "odom":
                    transform = fixed.get(frame) or moving.get(frame)
                    is_old = frame not in fixed and transform and transform.header.stamp != stamp
                    if transform is None or is_old:
                        return None
                    found[frame] = transform
                    frame = transform.header.frame_id
            return found

        return wait_for(chains, f"the transforms at {stamp.to_sec()} s")

    def picture_box(self):
        return wait_for(self._alive_and(self.screen.render_window), "rviz's window")

    def picture(self):
        return self.screen.grab(self.picture_box())

    def settled_picture(self, before=None, interval=0.03, times=3):
        """Returns the picture once it differs from `before` and then stays the same."""

        def next_settled():
            picture = self.picture()
            if before is not None and picture.tobytes() == before.tobytes():
                return None
            for _ in range(times):
                time.sleep(interval)
                if self.picture().tobytes() != picture.tobytes():
                    return None
            return picture

        return wait_for(self._alive_and(next_settled), "a picture that settles")

    def _alive_and(self, condition):
        def checked():
            if not self._launch.is_running() or "has died" in self.log():
                raise NodeHasEnded(f"a node has ended:\n{self.log()}")
            return condition()

        return checked

    def log(self):
        return "".join(process.output() for process in self._started)

    def start(self, command):
        """Starts another process, whose output becomes a part of the log."""
        self._started.append(self._processes.start(command))
        return self._started[-1]
