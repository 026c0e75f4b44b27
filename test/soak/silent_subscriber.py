"""Subscribers that never read delay no one and cause no memory growth."""

import usage
from bare_ros import BareSubscriber
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray
from walk import Pair
from walker_sim.msg import Transition

TOPICS = {"/transition": Transition, "/tf": TFMessage, "/state_markers": MarkerArray}


def run(soak):
    with soak.graph() as graph:
        server = graph.server()
        pair = Pair(server.name, graph.uri, 10.0)
        pair.reset(0)
        pair.step()
        before = usage.now(server.pid)
        uri = graph.node_uri(server.name)
        silent = [BareSubscriber(uri, t, kind) for t, kind in TOPICS.items() for _ in range(5)]
        watched, latency, steps = usage.Usage(server.pid), usage.Latency(), 0
        soak.begin()
        while steps == 0 or soak.goes_on():
            equal = True
            for _ in range(100):
                with latency:
                    equal = pair.step() and equal
            soak.check("the bits are right", equal)
            watched.sample()
            steps += 100
        for subscriber in silent:
            subscriber.close()
        watched.judge(soak.tally, "the server", f"{steps:,} steps, {len(silent)} that never read")
        latency.judge(soak.tally, "a step beside them, in process and over ROS")
        pair.steps(5)  # the server notices closed connections when it writes
        watched.judge_handles(soak.tally, "the server", before)
        pair.close()
