"""Reads an ONNX graph of fully connected layers as a network."""

from __future__ import annotations

import functools
import importlib
import json
from pathlib import Path
from typing import Any, Collection, Dict

import numpy as np
from numpy.typing import NDArray

from walker_sim.training.models import Array, Model, ModelError
from walker_sim.training.onnx_file import import_onnx, load_onnx
from walker_sim.training.policy_file import OBSERVATION_CLIP, OWN_METADATA, history_of

Constants = Dict[int, NDArray[Any]]
"""Constant inputs of a node by their positions. The missing one is the value of the node before."""

# Kinds of nodes that keep the values of their first input, and the order of these.
KEEPING = ("Identity", "Dropout", "Flatten", "Reshape", "Expand", "Squeeze", "Unsqueeze", "Cast")
KINDS = "Gemm, MatMul, Add, Sub, Mul, Div, Tanh, Relu, Clip, Max, Min"


def read_onnx(path: Path, sizes: Collection[tuple[int, int]]) -> Model:
    """Reads the graph's output. Of several it takes the only one that has a network with one of
    `sizes`, of observations and actions.

    ModelError if it is another file or graph, ImportError without onnx.
    """
    onnx = import_onnx()
    try:
        proto = onnx.load(str(path))
    except Exception as error:  # protobuf raises several types
        raise ModelError(f"not an ONNX file: {error}") from error
    found: dict[str, Model] = {}
    errors: list[ModelError] = []
    names = [output.name for output in proto.graph.output]
    for name in names:
        try:
            found[name] = _read_output(proto, name)
        except ModelError as error:
            errors.append(error)
        except Exception as error:  # onnx and its evaluators raise many types for a damaged graph
            errors.append(ModelError(f"output {name}: {_first_line(error)}"))
    if len(names) == 1 and errors:
        raise errors[0]
    if len(names) > 1:
        found = {name: model for name, model in found.items() if model.sizes in sizes}
    if len(found) != 1:
        fitting = " and ".join(found) or "none"
        raise ModelError(f"has outputs {names}, of which {fitting} fit an environment; must be one")
    return next(iter(found.values()))


def _read_output(proto: Any, output: str) -> Model:
    graph = _Graph(proto)
    chain = _Chain()
    with np.errstate(all="ignore"):  # what is not finite is refused with the policy
        for node, constants in graph.nodes_to(output):
            chain.add(node.op_type, constants, _attributes(node))
        layers, activation, ending = chain.finish()
    evaluator, run = load_onnx(proto, graph.input, output)

    def act(observations: NDArray[Any]) -> NDArray[Any]:
        """Runs the graph for one observation at a time, because it may allow no other number."""
        shape = (-1,) if graph.dimensions == 1 else (1, -1)
        inputs = observations.astype(graph.dtype)
        try:
            return np.stack([run(row.reshape(shape)).reshape(len(layers[-1][1])) for row in inputs])
        except Exception as error:  # each evaluator has its own types
            raise ModelError(f"{evaluator}: {_first_line(error)}") from error

    metadata = {each.key: each.value for each in proto.metadata_props}
    is_ours = proto.producer_name == "walker_sim"
    notes = {name: text for name, text in metadata.items() if name not in OWN_METADATA}
    size = layers[0][0].shape[1]
    return Model(
        layers,
        activation,
        ending,
        act,
        notes if is_ours else {"algorithm": "onnx"},
        normalization=chain.normalization(size) if chain.normalises else None,
        limits=chain.limits(len(layers[-1][1])),
        env_id=metadata.get("id", "") if is_ours else "",
        parameters=json.loads(metadata.get("parameters", "{}")) if is_ours else {},
        history=history_of(metadata) if is_ours else None,
    )


def _first_line(error: Exception) -> str:
    return f"{type(error).__name__}: {str(error).strip().partition(chr(10))[0]}"


def _attributes(node: Any) -> dict[str, Any]:
    get: Any = import_onnx().helper.get_attribute_value
    return {each.name: get(each) for each in node.attribute}


class _Graph:
    """The nodes of a model by their outputs, and its constants."""

    def __init__(self, proto: Any) -> None:
        self._onnx: Any = import_onnx()
        self._opsets = proto.opset_import
        self._initializers = {each.name: each for each in proto.graph.initializer}
        self._values: dict[str, NDArray[Any]] = {}
        inputs = [each for each in proto.graph.input if each.name not in self._initializers]
        if len(inputs) != 1:
            names = ", ".join(each.name for each in inputs) or "none"
            raise ModelError(f"has inputs {names}; must have one")
        self.input = inputs[0].name
        tensor = inputs[0].type.tensor_type
        kinds = {1: np.float32, 10: np.float16, 11: np.float64}
        if tensor.elem_type not in kinds:
            raise ModelError(f"input {self.input}: must be of float16, float32 or float64")
        self.dtype = kinds[tensor.elem_type]
        self.dimensions = len(tensor.shape.dim) if tensor.HasField("shape") else 2
        self._makers = {name: node for node in proto.graph.node for name in node.output}
        self._constants = set(self._initializers)
        for node in proto.graph.node:
            if all(name in self._constants for name in node.input if name):
                self._constants.update(node.output)

    def nodes_to(self, output: str) -> list[tuple[Any, Constants]]:
        """Returns the nodes from the input to this output, in this order."""
        nodes: list[tuple[Any, Constants]] = []
        name = output
        while name != self.input:
            node = self._makers.get(name)
            if node is None or name in self._constants:
                raise ModelError(f"output {output}: {name} does not depend on the input")
            if len(nodes) == len(self._makers):
                raise ModelError(f"output {output}: has a cycle")
            inputs = node.input[:1] if node.op_type in KEEPING else node.input
            names = [each for each in inputs if each and each not in self._constants]
            if len(names) != 1:
                raise ModelError(
                    f"has a node {node.op_type} with {len(names)} inputs that are not constants; "
                    "must be one"
                )
            name = names[0]
            numbered = enumerate(inputs)
            constants = {i: self._value(each) for i, each in numbered if each not in ("", name)}
            nodes.append((node, constants))
        return nodes[::-1]

    def _value(self, name: str) -> NDArray[Any]:
        """Returns a constant, which may be computed from others."""
        if name in self._initializers and name not in self._values:
            self._values[name] = self._onnx.numpy_helper.to_array(self._initializers[name])
        if name not in self._values:
            node, helper = self._makers[name], self._onnx.helper
            given = {each: self._value(each) for each in node.input if each}
            ends = [map(helper.make_empty_tensor_value_info, each) for each in (given, [name])]
            alone = helper.make_graph([node], "constant", *map(list, ends))
            reference: Any = importlib.import_module("onnx.reference")
            runner = reference.ReferenceEvaluator(
                helper.make_model(alone, opset_imports=self._opsets)
            )
            (self._values[name],) = runner.run([name], given)
        return self._values[name]


class _Chain:
    """A network, a node at a time: what normalises the observation, layers with an activation
    between them, and what scales and limits the last layer's values."""

    def __init__(self) -> None:
        self.normalises = False
        self._is_clipped = False  # whether the observations are
        self._mean: Any = 0.0
        self._deviation: Any = 1.0
        self._layers: list[tuple[NDArray[Any], NDArray[Any]]] = []
        self._activations: list[str] = []
        self._scale: Any = 1.0  # of the values after the last activation
        self._offset: Any = 0.0
        self._low: Any = None
        self._high: Any = None

    def add(self, kind: str, constants: Constants, settings: dict[str, Any]) -> None:
        """Adds a node. `settings`: its attributes."""
        for constant in constants.values():
            if constant.dtype.kind != "f":
                raise ModelError(f"has a {kind} with a constant of {constant.dtype}; must be real")
        is_first = 0 not in constants
        if kind in KEEPING:
            if kind == "Cast" and settings.get("to") not in (1, 10, 11):
                raise ModelError("has a Cast to another type than float16, float32 or float64")
        elif kind in ("Clip", "Max", "Min"):
            self._limit(kind, constants, settings)
        elif self._low is not None or self._high is not None:
            raise ModelError(f"has a {kind} after Clip, Max or Min; they must be last")
        elif kind == "Gemm" and is_first:
            self._add_gemm(constants, settings)
        elif kind == "MatMul" and is_first:
            self._add_layer(constants[1].T, np.zeros(1))
        elif kind in ("Tanh", "Relu"):
            if len(self._activations) >= len(self._layers):
                raise ModelError(f"has a {kind} that does not follow a layer")
            self._activations.append(kind.lower())
        elif kind == "Add":
            self._change(1, 1, constants[is_first])
        elif kind == "Sub":
            self._change(*((1, 1, -constants[1]) if is_first else (-1, 1, constants[0])))
        elif kind == "Mul":
            self._change(constants[is_first], 1, 0)
        elif kind == "Div" and is_first:
            self._change(1, constants[1], 0)
        elif kind == "Scaler":
            self._change(1, 1, -np.array(settings.get("offset", 0.0)))
            self._change(np.array(settings.get("scale", 1.0)), 1, 0)
        else:
            raise ModelError(f"has a node {kind}; must be {KINDS}, of a value and constants")

    def _add_gemm(self, constants: Constants, settings: dict[str, Any]) -> None:
        if settings.get("transA", 0):
            raise ModelError("has a Gemm with transA")
        weight = constants[1] if settings.get("transB", 0) else constants[1].T
        bias = constants.get(2, np.zeros(1))
        self._add_layer(settings.get("alpha", 1) * weight, settings.get("beta", 1) * bias)

    def _add_layer(self, weight: NDArray[Any], bias: NDArray[Any]) -> None:
        if weight.ndim != 2:
            raise ModelError(f"has a weight of shape {weight.shape}; must have two dimensions")
        if len(self._activations) < len(self._layers):
            raise ModelError("has two layers without Tanh or Relu between them")
        if self._layers and weight.shape[1] != len(self._layers[-1][1]):
            raise ModelError(
                f"has a layer of {weight.shape[1]} inputs after {len(self._layers[-1][1])} outputs"
            )
        outputs, inputs = weight.shape
        offset = weight @ _row(self._offset, inputs)
        self._layers.append((weight * _row(self._scale, inputs), offset + _row(bias, outputs)))
        self._scale, self._offset = 1.0, 0.0

    def _change(self, factor: Any, divisor: Any, summand: Any) -> None:
        """Replaces each value x by x factor / divisor + summand."""
        if not self._layers:
            if self._is_clipped:
                raise ModelError("normalises observations after their Clip; must be before it")
            self.normalises = True
            self._deviation = self._deviation * divisor / factor
            self._mean = self._mean - self._deviation * summand
        elif len(self._activations) < len(self._layers):
            weight, bias = self._layers[-1]
            size = len(bias)
            ratio = _row(factor, size) / _row(divisor, size)
            self._layers[-1] = weight * ratio[:, np.newaxis], bias * ratio + _row(summand, size)
        else:
            self._scale = self._scale * factor / divisor
            self._offset = self._offset * factor / divisor + summand

    def _limit(self, kind: str, constants: Constants, settings: dict[str, Any]) -> None:
        low: Any = -np.inf
        high: Any = np.inf
        if kind == "Clip":  # before opset 11 the limits are attributes
            low = constants.get(1, settings.get("min", low))
            high = constants.get(2, settings.get("max", high))
        elif kind == "Max":
            low = functools.reduce(np.maximum, constants.values(), low)
        else:
            high = functools.reduce(np.minimum, constants.values(), high)
        if not self._layers:
            if np.any(low != -OBSERVATION_CLIP) or np.any(high != OBSERVATION_CLIP):
                raise ModelError(
                    f"limits observations; must be by Clip to {OBSERVATION_CLIP:g}, and after they "
                    "are normalised"
                )
            self._is_clipped = True
            return
        self._low = low if self._low is None else np.maximum(self._low, low)
        self._high = high if self._high is None else np.minimum(self._high, high)

    def finish(self) -> tuple[list[tuple[Array, Array]], str, str]:
        """Returns the layers, the activation and the output, as `Model` has them."""
        if not self._layers:
            raise ModelError("has no layer")
        activations = list(self._activations)
        output = "clip"
        if len(activations) == len(self._layers):
            output = activations.pop()
            if output != "tanh":
                raise ModelError("ends in Relu; must end in a layer or Tanh")
        if len(set(activations)) > 1:
            raise ModelError("has tanh and relu; must have one of them")
        layers = [
            (np.ascontiguousarray(weight, np.float32), np.asarray(bias, np.float32))
            for weight, bias in self._layers
        ]
        return layers, activations[0] if activations else "tanh", output

    def normalization(self, size: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Returns mean and deviation of the observations."""
        return _row(self._mean, size), _row(self._deviation, size)

    def limits(self, size: int) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Returns the lower and upper limits of the actions; None: the environment's."""
        low, high = self._low, self._high
        is_scaled = np.any(self._scale != 1) or np.any(self._offset != 0)
        if is_scaled and low is None:
            low = self._offset - self._scale
        if is_scaled and high is None:
            high = self._offset + self._scale
        if low is None and high is None:
            return None
        return _row(-np.inf if low is None else low, size), _row(
            np.inf if high is None else high, size
        )


def _row(values: Any, size: int) -> NDArray[np.float64]:
    """Returns one value for each of `size`, of an array that broadcasts to shape (1, size)."""
    values = np.asarray(values, np.float64)
    try:
        return np.array(np.broadcast_to(values, (1, size))[0])
    except ValueError:
        raise ModelError(f"has a constant of shape {values.shape} for {size} values") from None
