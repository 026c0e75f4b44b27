"""Writes a policy as an ONNX graph from raw observations to actions, and runs such a graph."""

from __future__ import annotations

import importlib
import json
from typing import Any, Callable

import numpy as np
from numpy.typing import NDArray

import walker_sim
from walker_sim.training.policy_file import OBSERVATION_CLIP, PolicyFile, history_notes

OPSET = 13  # of 2020: the first in which every operator below takes float64 where it has to
IR_VERSION = 7  # of the same release of ONNX


def import_onnx() -> Any:
    """Imports onnx; ImportError with the remedy if it is not installed."""
    try:
        return importlib.import_module("onnx")
    except ImportError as error:
        raise ImportError(f"needs onnx: pip install onnx ({error})") from error


class _Graph:
    """Nodes in a chain, each of which takes the value before it, and their constants."""

    def __init__(self, onnx: Any, first: str) -> None:
        self.onnx = onnx
        self.nodes: list[Any] = []
        self.constants: list[Any] = []
        self.last = first

    def add(self, kind: str, *constants: tuple[str, Any], **attributes: Any) -> None:
        """Adds a node; `constants` are names and arrays, or numbers of NumPy."""
        for name, value in constants:
            self.constants.append(self.onnx.numpy_helper.from_array(np.asarray(value), name))
        inputs = [self.last, *(name for name, _ in constants)]
        self.last = f"value_{len(self.nodes)}"
        self.nodes.append(self.onnx.helper.make_node(kind, inputs, [self.last], **attributes))


def to_model(policy: PolicyFile, dtype: str) -> Any:
    """Returns the policy as an ONNX model; ImportError without onnx.

    The model computes as src/policy/network.cpp does: it normalises in double precision, and the
    layers are in single precision. Input ``observation``, shape (n, observation size), has the type
    of the environment's observations, `dtype`; output ``action``, shape (n, action size), is
    float32. With a history the observation is the whole input. The model's metadata is
    that of the policy file.
    """
    onnx = import_onnx()
    helper, types = onnx.helper, onnx.TensorProto
    graph = _Graph(onnx, "observation")
    if dtype != "float64":
        graph.add("Cast", to=types.DOUBLE)
    graph.add("Sub", ("mean", policy.mean))
    graph.add("Div", ("deviation", policy.deviation))
    limit = np.float64(OBSERVATION_CLIP)
    graph.add("Clip", ("normal_low", -limit), ("normal_high", limit))
    graph.add("Cast", to=types.FLOAT)
    for index, (weight, bias) in enumerate(policy.layers):
        graph.add("Gemm", (f"weight_{index}", weight), (f"bias_{index}", bias), transB=1)
        if index + 1 < len(policy.layers):
            graph.add({"tanh": "Tanh", "relu": "Relu"}[policy.activation])
    if policy.output == "tanh":
        graph.add("Tanh")
        graph.add("Add", ("one", np.ones(1, np.float32)))
        graph.add("Mul", ("half_range", (policy.high - policy.low) / np.float32(2)))
        graph.add("Add", ("offset", policy.low))
    graph.add("Max", ("low", policy.low))
    graph.add("Min", ("high", policy.high))
    graph.nodes[-1].output[0] = "action"
    element = types.DOUBLE if dtype == "float64" else types.FLOAT
    ends = [
        helper.make_tensor_value_info("observation", element, ["n", len(policy.mean)]),
        helper.make_tensor_value_info("action", types.FLOAT, ["n", len(policy.low)]),
    ]
    model = helper.make_model(
        helper.make_graph(graph.nodes, policy.env_id, ends[:1], ends[1:], graph.constants),
        producer_name="walker_sim",
        producer_version=walker_sim.__version__,
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
    )
    parameters = json.dumps(policy.parameters, sort_keys=True)
    own = {"id": policy.env_id, "parameters": parameters, **history_notes(policy)}
    helper.set_model_props(model, {**own, **policy.notes})
    onnx.checker.check_model(model, full_check=True)
    return model


Act = Callable[[NDArray[Any]], NDArray[Any]]


def load_onnx(model: Any, start: str, end: str) -> tuple[str, Act]:
    """Loads a model with ONNX Runtime or, without it, onnx's own evaluator. Returns the evaluator's
    name and a function from the input `start` to the output `end`."""
    try:
        runtime: Any = importlib.import_module("onnxruntime")
    except ImportError:
        reference: Any = importlib.import_module("onnx.reference")
        runner = reference.ReferenceEvaluator(model)
        name = "onnx's reference evaluator"
    else:
        options = runtime.SessionOptions()
        options.log_severity_level = 4  # its errors are exceptions too
        runner = runtime.InferenceSession(
            model.SerializeToString(), options, providers=["CPUExecutionProvider"]
        )
        name = "ONNX Runtime"

    def act(observations: NDArray[Any]) -> NDArray[Any]:
        (actions,) = runner.run([end], {start: observations})
        return np.asarray(actions)

    return name, act
