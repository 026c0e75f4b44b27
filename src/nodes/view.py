#!/usr/bin/python3
"""Starts rviz for a walker whose frames have a prefix.

rviz reads frame names from its configuration only. This program writes a copy of a configuration
with prefixed frames to ROS_HOME and replaces itself with rviz.

Usage: view.py CONFIGURATION TF_PREFIX
"""

import os
import sys

import rospkg
import yaml

PREFIXED = ("rviz/RobotModel", "walker_sim/Push")  # classes with a property TF Prefix


def put_prefix(configuration, prefix):
    """Add the prefix to all frames of the configuration, a tree of dictionaries, and return it."""
    manager = configuration["Visualization Manager"]
    view = manager["Views"]["Current"]
    manager["Global Options"]["Fixed Frame"] = (
        prefix + "/" + manager["Global Options"]["Fixed Frame"]
    )
    view["Target Frame"] = prefix + "/" + view["Target Frame"]
    for part in manager["Displays"] + manager["Tools"]:
        if part["Class"] in PREFIXED:
            part["TF Prefix"] = prefix
    return configuration


def open_standard_descriptors():
    """Open /dev/null as each standard descriptor that rviz would not inherit."""
    null = os.open(os.devnull, os.O_RDWR)
    for descriptor in range(3):
        try:
            is_given = os.get_inheritable(descriptor)  # not those that Python opened
        except OSError:
            is_given = False
        if not is_given:
            os.dup2(null, descriptor)
            os.set_inheritable(descriptor, True)


def main():
    """Replace this process with rviz."""
    # roslaunch appends remappings for the node's name and log; they are meant for rviz.
    remappings = [argument for argument in sys.argv[1:] if ":=" in argument]
    template, prefix = [argument for argument in sys.argv[1:] if ":=" not in argument]
    prefix = prefix.strip("/")
    with open(template, encoding="utf-8") as file:
        configuration = put_prefix(yaml.safe_load(file), prefix)
    path = os.path.join(rospkg.get_ros_home(), "walker_sim_" + prefix.replace("/", "_") + ".rviz")
    with open(path, "w", encoding="utf-8") as file:
        yaml.safe_dump(configuration, file)
    open_standard_descriptors()
    os.execvp("rviz", ["rviz", "-d", path, *remappings])


if __name__ == "__main__":
    main()
