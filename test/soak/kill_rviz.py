"""rviz is killed at random times: the walker walks on, and the server leaks nothing."""

import os
import shutil
import time

import usage
from bare_ros import BareSubscriber
from graph import ROOT, await_true
from walker_sim.msg import Transition

DT = 20_000_000  # [ns]


def run(soak):
    missing = [name for name in ("rviz", "Xvfb") if not shutil.which(name)]
    if missing:
        soak.leave_out(f"without {' and '.join(missing)}")
        return
    with soak.graph() as graph:
        display = start_screen(graph)
        server = graph.server(mode="free")
        subscriber = BareSubscriber(graph.node_uri(server.name), "/transition", Transition)
        before, last = None, subscriber.next()
        environment = {"DISPLAY": display, "LIBGL_ALWAYS_SOFTWARE": "1"}
        command = ["rviz", "-d", ROOT / "config" / "bipedal_walker.rviz"]
        for number in soak.rounds():
            viewer = graph.start(command, environment=environment)
            await_true(lambda: listens(graph), "rviz to listen")
            time.sleep(soak.random.uniform(0, 1))
            viewer.kill()
            stamp = last.header.stamp
            end, gaps = time.monotonic() + 0.2, 0
            while time.monotonic() < end:
                following = subscriber.next()
                gaps += (following.header.stamp - last.header.stamp).to_nsec() != DT
                last = following
            soak.check("the walker walks on, step by step", gaps == 0 and last.header.stamp > stamp)
            forget(graph)
            if before is None and number == 0:
                before = settled(server)
        usage.Usage(server.pid).check_handles(soak.tally, "the server", before)
        soak.check("the server runs", server.process.poll() is None, server.output())
        subscriber.close()


def start_screen(graph):
    read, write = os.pipe()
    words = ["Xvfb", "-displayfd", write, "-screen", "0", "800x600x24", "-nolisten", "tcp"]
    graph.start(words, pass_fds=[write])
    os.close(write)
    with os.fdopen(read) as pipe:
        return f":{pipe.readline().strip()}"


def listens(graph):
    state = graph.ask("getSystemState")
    return state and any(topic == "/scene_markers" for topic, _ in state[1])


def forget(graph):
    """Removes the killed rviz's registrations, which stay; the next rviz has another name."""
    for topic, nodes in graph.ask("getSystemState")[1]:
        for node in nodes:
            if node.startswith("/rviz"):
                graph.forget(node, topic)


def settled(server):
    """Returns the server's usage after the first rviz, when it has loaded everything it needs."""
    time.sleep(1)
    return usage.now(server.pid)
