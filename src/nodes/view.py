#!/usr/bin/python3
"""rviz for a walker whose frames have a prefix.

rviz takes frames from its configuration alone. This writes a copy of a configuration with the
prefix put in, below ROS_HOME, and becomes rviz.

Usage: view.py CONFIGURATION TF_PREFIX
"""

import os
import sys

import rospkg
import yaml


def put_prefix(configuration, prefix):
    """Return the configuration (a tree of dictionaries) for frames under the prefix."""
    manager = configuration["Visualization Manager"]
    view = manager["Views"]["Current"]
    manager["Global Options"]["Fixed Frame"] = (
        prefix + "/" + manager["Global Options"]["Fixed Frame"]
    )
    view["Target Frame"] = prefix + "/" + view["Target Frame"]
    for display in manager["Displays"]:
        if display["Class"] == "rviz/RobotModel":
            display["TF Prefix"] = prefix
    return configuration


def open_standard_descriptors():
    """Give rviz /dev/null in place of standard descriptors that were closed."""
    null = os.open(os.devnull, os.O_RDWR)
    for descriptor in range(3):
        try:
            is_given = os.get_inheritable(descriptor)  # what Python opens is not
        except OSError:
            is_given = False
        if not is_given:
            os.dup2(null, descriptor)
            os.set_inheritable(descriptor, True)


def main():
    """Become rviz."""
    # What roslaunch appended, the node's name and its log, is meant for rviz.
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
