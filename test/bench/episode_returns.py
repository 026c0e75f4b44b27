"""Prints seed, return and length of each episode that ends on the topic `episode`."""

import argparse
import json
import sys
import threading

import rospy
from walker_sim.msg import Episode


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, required=True, help="number of seeds")
    parser.add_argument("--while", type=int, required=True, dest="agent", help="PID of the agent")
    arguments = parser.parse_args()
    count = arguments.count
    found, is_done = {}, threading.Event()

    def add(episode):
        has_ended = episode.length and episode.has_seed
        if has_ended and episode.seed not in found and not is_done.is_set():
            found[episode.seed] = episode.episode_return, episode.length
            if len(found) == count:
                is_done.set()

    rospy.init_node("episode_returns", anonymous=True, disable_rostime=True, disable_signals=True)
    rospy.Subscriber("episode", Episode, add, queue_size=100)
    while not is_done.wait(1):
        with open(f"/proc/{arguments.agent}/stat", encoding="utf-8") as file:
            if file.read().rpartition(")")[2].split()[0] == "Z":
                sys.exit(f"the agent has ended, after {len(found)} of {count} episodes")
    for seed, (episode_return, length) in sorted(found.items()):
        print(json.dumps({"seed": seed, "return": episode_return, "length": length}))


if __name__ == "__main__":
    main()
