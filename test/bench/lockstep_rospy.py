#!/usr/bin/python3
"""Steps one environment in lock-step through rospy and prints a line of JSON.

lockstep_rospy.py --server /walker_sim --seconds S
"""

import argparse
import json
import struct
import time
from random import Random

import rospy
from walker_sim.srv import GetSpec, Reset, Step

CALLS_TO_WARM_UP = 200


def draw_actions(size):
    """Returns 1000 actions whose values are exact in float32."""
    random = Random(1)
    return [
        list(struct.unpack(f"{size}f", struct.pack(f"{size}f", *values)))
        for values in ([random.uniform(-1, 1) for _ in range(size)] for _ in range(1000))
    ]


class Walk:
    def __init__(self, server):
        for service in ("get_spec", "reset", "step"):
            rospy.wait_for_service(f"{server}/{service}", timeout=10)
        spec = rospy.ServiceProxy(f"{server}/get_spec", GetSpec)().spec
        self._reset = rospy.ServiceProxy(f"{server}/reset", Reset, persistent=True)
        self._step = rospy.ServiceProxy(f"{server}/step", Step, persistent=True)
        self._actions = draw_actions(spec.action_size)
        self._next = 0
        self._check(self._reset(has_seed=True, seed=0))

    def _check(self, reply):
        if not reply.success:
            raise RuntimeError(reply.status_message)
        self._has_ended = reply.transition.terminated or reply.transition.truncated

    def step(self):
        self._check(self._step(self._actions[self._next]))
        self._next = (self._next + 1) % len(self._actions)

    def reset_if_ended(self):
        if self._has_ended:
            self._check(self._reset(has_seed=False))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--server", default="/walker_sim")
    parser.add_argument("--seconds", type=float, required=True)
    arguments = parser.parse_args()
    rospy.init_node("lockstep_rospy", anonymous=True)
    walk = Walk(arguments.server)
    for _ in range(CALLS_TO_WARM_UP):
        walk.step()
        walk.reset_if_ended()
    latencies = []
    begin = now = time.perf_counter()
    while now - begin < arguments.seconds:
        walk.step()
        latencies.append(time.perf_counter() - now)
        walk.reset_if_ended()
        now = time.perf_counter()
    latencies.sort()
    quantiles = {
        f"p{percent}": 1e6 * latencies[(len(latencies) - 1) * percent // 100]
        for percent in (50, 99)
    }
    print(json.dumps({"steps": len(latencies), "seconds": now - begin, "latency_us": quantiles}))


if __name__ == "__main__":
    main()
