#!/usr/bin/python3
"""Runs a rostest in Python, given by its path below test/ without .py, in a node of its name."""

import pathlib
import sys

import rospy
import rostest

TEST = pathlib.Path(__file__).resolve().parent

if __name__ == "__main__":
    rooms = ("", "agents", "promises", "server", "server/transport")
    sys.path[:0] = [str(TEST / room) for room in rooms]
    name = sys.argv[1].rpartition("/")[2]
    rospy.init_node(name)
    rostest.rosrun("walker_sim", name, name, sys.argv)
