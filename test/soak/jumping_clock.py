"""A /clock that jumps: a follower neither goes back nor catches up in a burst."""

import contextlib
import subprocess
import sys
import threading
import time

from bare_ros import BareSubscriber
from graph import await_true
from walker_sim.msg import Transition

DT = 20_000_000  # the follower's step [ns]
MOST_AT_ONCE = 6  # maximum steps after a jump forwards

# Publishes each time [ns] that it reads from stdin.
PUBLISHER = """
import sys, rospy
from rosgraph_msgs.msg import Clock
rospy.init_node("jumping_clock", disable_signals=True, disable_rostime=True)
publisher = rospy.Publisher("/clock", Clock, queue_size=100, tcp_nodelay=True)
for line in sys.stdin:
    nanoseconds = int(line)
    publisher.publish(rospy.Time(nanoseconds // 10**9, nanoseconds % 10**9))
"""


class FollowedClock:
    """A clock, its follower, and the stamps that the follower has published."""

    def __init__(self, graph):
        graph.ask("setParam", "/use_sim_time", True)
        command = [sys.executable, "-c", PUBLISHER]
        self._node = graph.start(command, stdin=subprocess.PIPE)
        self.now = 10**12
        self.server = graph.server(mode="free", publish_clock="false")
        self.stamps = []
        uri = graph.node_uri(self.server.name)
        self._subscriber = BareSubscriber(uri, "/transition", Transition)
        threading.Thread(target=self._listen, daemon=True).start()
        await_true(lambda: self.tick() or self.stamps, "the follower to join the clock")

    def _listen(self):
        with contextlib.suppress(OSError):
            while True:
                self.stamps.append(self._subscriber.next().header.stamp.to_nsec())

    def set(self, now):
        self.now = now
        self._node.process.stdin.write(b"%d\n" % now)
        self._node.process.stdin.flush()

    def tick(self, count=1):
        for _ in range(count):
            self.set(self.now + DT)
            time.sleep(0.005)

    def settle(self):
        """Waits until the follower has published nothing for 0.15 s."""
        count = -1
        while count != len(self.stamps):
            count = len(self.stamps)
            time.sleep(0.15)

    def close(self):
        self._node.process.stdin.close()
        self._subscriber.close()


def run(soak):
    with soak.graph() as graph:
        clock = FollowedClock(graph)
        graph.callback(clock.close)
        for number in soak.rounds():
            before = len(clock.stamps)
            clock.tick(30)
            await_true(lambda: clock.stamps[-1] > clock.now - 2 * DT, "the follower to keep up")
            soak.check("it follows", len(clock.stamps) > before, f"round {number}")
            clock.settle()
            if number % 2:
                jump_forwards(soak, clock)
            else:
                jump_back(soak, clock)
            rising = all(a < b for a, b in zip(clock.stamps, clock.stamps[1:]))
            soak.check("its time never runs backwards", rising, clock.stamps[-10:])
        soak.check("the server runs", clock.server.process.poll() is None, clock.server.output())


def jump_forwards(soak, clock):
    before = len(clock.stamps)
    clock.set(clock.now + soak.random.choice([10, 3600, 10**6]) * 10**9)
    await_true(lambda: clock.stamps[-1] > clock.now - 2 * DT, "the follower to jump along")
    clock.settle()
    made = len(clock.stamps) - before
    soak.check(
        "a jump forwards is followed by few steps", 0 < made <= MOST_AT_ONCE, f"{made} steps"
    )


def jump_back(soak, clock):
    before, told = len(clock.stamps), clock.server.output().count("set back by")
    here = clock.now
    clock.set(here - soak.random.choice([1, 60, 900]) * 10**9)
    clock.settle()
    soak.check("after a jump back nothing moves", len(clock.stamps) == before)
    if not told:  # the log is throttled and may omit later ones
        said = await_true(lambda: "set back by" in clock.server.output(), "the log to say so", 10)
        soak.check("the log says by how much it was set back", said)
    clock.set(here + DT)
    await_true(lambda: clock.stamps[-1] > here - 2 * DT, "the follower to go on")
