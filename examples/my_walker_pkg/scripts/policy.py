#!/usr/bin/python3
"""Drives the walker as on a robot: answers each observation (50 Hz) with joint torques.

~policy: path of a walker_sim policy file; docs/policies.md describes the format.
"""

import json
import struct

import numpy
import rospy
from std_msgs.msg import Float64MultiArray

EFFORT_PER_ACTION = 80.0  # BipedalWalker's motor torque at action 1 [N m]
TYPES = {"F32": "<f4", "F64": "<f8"}


class Policy:
    """Multilayer perceptron with tanh between the layers and a clipped output."""

    def __init__(self, path):
        with open(path, "rb") as file:
            (size,) = struct.unpack("<Q", file.read(8))
            header = json.loads(file.read(size))
            data = file.read()
        notes = header.pop("__metadata__")
        if (notes["activation"], notes["output"]) != ("tanh", "clip"):
            raise ValueError(f"{path}: {notes['activation']}, {notes['output']}: not known here")
        if "history.observations" in notes:
            raise ValueError(f"{path}: acts on its latest observations: not known here")
        tensors = {}
        for name, entry in header.items():
            begin, end = entry["data_offsets"]
            values = numpy.frombuffer(data[begin:end], TYPES[entry["dtype"]])
            tensors[name] = values.reshape(entry["shape"])
        self.mean, self.deviation = tensors["observation.mean"], tensors["observation.deviation"]
        self.low, self.high = tensors["action.low"], tensors["action.high"]
        self.layers = [
            (tensors[f"layers.{i}.weight"], tensors[f"layers.{i}.bias"])
            for i in range(int(notes["layers"]))
        ]

    def act(self, observation):
        x = numpy.clip((numpy.array(observation) - self.mean) / self.deviation, -10, 10)
        x = x.astype(numpy.float32)
        for weight, bias in self.layers[:-1]:
            x = numpy.tanh(weight @ x + bias)
        weight, bias = self.layers[-1]
        return numpy.clip(weight @ x + bias, self.low, self.high)


def main():
    rospy.init_node("policy")
    policy = Policy(rospy.get_param("~policy"))
    publisher = rospy.Publisher("effort_command", Float64MultiArray, queue_size=1, tcp_nodelay=True)

    def answer(observation):
        effort = EFFORT_PER_ACTION * policy.act(observation.data)
        publisher.publish(data=effort.tolist())

    rospy.Subscriber("observation", Float64MultiArray, answer, queue_size=1, tcp_nodelay=True)
    rospy.spin()


if __name__ == "__main__":
    main()
