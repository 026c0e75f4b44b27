"""Steps one environment in lock-step through rospy and prints a line of JSON.

lockstep_rospy.py --server /walker_sim --seconds S
"""

import argparse
import json
import time

import rospy
from gymnasium.spaces import Box
from peers import measure
from walker_sim.commands.bench import random_actions
from walker_sim.srv import GetSpec, Reset, Step


class Client:
    def __init__(self, server):
        for service in ("get_spec", "reset", "step"):
            rospy.wait_for_service(f"{server}/{service}", timeout=10)
        spec = rospy.ServiceProxy(f"{server}/get_spec", GetSpec)().spec
        self._reset = rospy.ServiceProxy(f"{server}/reset", Reset, persistent=True)
        self._step = rospy.ServiceProxy(f"{server}/step", Step, persistent=True)
        self._actions = random_actions(Box(-1, 1, (spec.action_size,)))
        self.latencies = []  # [us]
        self._call(self._reset, has_seed=True, seed=0)

    def step(self):
        action = next(self._actions).tolist()
        begin = time.perf_counter()
        has_ended = self._call(self._step, action)
        self.latencies.append(1e6 * (time.perf_counter() - begin))
        if has_ended:
            self._call(self._reset, has_seed=False)
        return 1

    @staticmethod
    def _call(service, *arguments, **keywords):
        """Returns whether the episode has ended."""
        reply = service(*arguments, **keywords)
        if not reply.success:
            raise RuntimeError(reply.status_message)
        return reply.transition.terminated or reply.transition.truncated


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--server", default="/walker_sim")
    parser.add_argument("--seconds", type=float, required=True)
    arguments = parser.parse_args()
    # As README's program: it needs no time.
    rospy.init_node("lockstep_rospy", anonymous=True, disable_rostime=True)
    client = Client(arguments.server)
    slice_ = measure(arguments.seconds, client.step)
    client.latencies.sort()
    last = len(client.latencies) - 1
    quantiles = {f"p{percent}": client.latencies[last * percent // 100] for percent in (50, 99)}
    print(json.dumps({**slice_, "latency_us": quantiles}))


if __name__ == "__main__":
    main()
