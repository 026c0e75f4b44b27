"""convert: a policy file that is written from an exporter's ONNX graph acts as the graph does."""

import sys

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper
from walker_sim import _core


class Model:
    """ONNX model of a network of two layers with tanh, as an exporter writes it."""

    def __init__(self, shape=("n", 17), element=TensorProto.FLOAT):
        random = np.random.default_rng(3)
        self.arrays = {}
        for index, (inputs, outputs) in enumerate([(17, 20), (20, 6)]):
            self.arrays[f"w{index}"] = random.normal(0, 0.3, (inputs, outputs)).astype(np.float32)
            self.arrays[f"b{index}"] = random.normal(0, 0.3, outputs).astype(np.float32)
        self.inputs = [helper.make_tensor_value_info("x", element, shape)]
        self.outputs = ["y"]
        self.nodes = []
        self.element = element

    def add(self, kind, *names, **attributes):
        """Adds a node; the last name is that of its output."""
        self.nodes.append(helper.make_node(kind, names[:-1], names[-1:], **attributes))
        return self

    def add_layers(self, start="x", end="y"):
        self.add("Gemm", start, "w0", "b0", "h0").add("Tanh", "h0", "h1")
        return self.add("Gemm", "h1", "w1", "b1", end)

    def constant(self, name, value):
        self.arrays[name] = np.asarray(value)
        return self

    def save(self, path):
        ends = [helper.make_tensor_value_info(name, self.element, None) for name in self.outputs]
        arrays = [numpy_helper.from_array(array, name) for name, array in self.arrays.items()]
        graph = helper.make_graph(self.nodes, "walker", self.inputs, ends, arrays)
        opsets = [helper.make_opsetid("", 17), helper.make_opsetid("ai.onnx.ml", 3)]
        onnx.save(helper.make_model(graph, opset_imports=opsets, ir_version=8), path)
        return path

    def values(self, observations):
        """Returns what the last layer gives."""
        hidden = np.tanh(observations @ self.arrays["w0"] + self.arrays["b0"].ravel())
        return hidden @ self.arrays["w1"] + self.arrays["b1"].ravel()

    def act(self, observations):
        return self.values(observations).clip(-1, 1)


def ending_in_tanh():
    model = Model().add_layers(end="h2").add("Tanh", "h2", "y")
    return model, lambda observations: np.tanh(model.values(observations))


def as_skl2onnx(element):
    """MLPRegressor: rows as biases, and all actions in one column."""
    model = Model(element=element)
    number = np.float64 if element == TensorProto.DOUBLE else np.float32
    model.arrays = {
        name: array.astype(number).reshape(-1 if name == "w1" else 1, *array.shape[-1:])
        if name[0] == "b"
        else array.astype(number)
        for name, array in model.arrays.items()
    }
    model.add("Cast", "x", "cast", to=element).add("MatMul", "cast", "w0", "m0")
    model.add("Add", "m0", "b0", "h0").add("Tanh", "h0", "h1").add("MatMul", "h1", "w1", "m1")
    model.constant("shape", [-1, 1])
    return model.add("Add", "m1", "b1", "a").add("Reshape", "a", "shape", "y"), model.act


def as_sb3():
    """PPO: actions, values and log-probabilities of one observation; what is shared is renamed."""
    model = Model((1, 17))
    model.outputs = ["y", "value", "log_prob"]
    model.constant("one", np.ones((20, 1), np.float32)).constant("size", [-1, 6])
    model.add("Identity", "b0", "bias").add("Flatten", "x", "flat")
    model.add("Gemm", "flat", "w0", "bias", "h0").add("Tanh", "h0", "h1")
    model.add("MatMul", "h1", "one", "value").add("Gemm", "h1", "w1", "b1", "mean")
    model.add("Shape", "mean", "shape").add("Expand", "mean", "shape", "wide")
    model.add("Sub", "wide", "mean", "log_prob").add("Reshape", "wide", "size", "y")
    return model, model.act


def as_tf2onnx():
    """Keras with Normalization and BatchNormalization: without biases of zero."""
    model = Model()
    mean, scale = np.linspace(-1, 1, 17, dtype=np.float32)[np.newaxis], np.float32(0.25)
    factor, summand = np.linspace(0.5, 2, 20, dtype=np.float32), np.float32(0.125)
    model.constant("mean", mean).constant("scale", scale)
    model.constant("factor", factor).constant("summand", summand)
    model.add("Sub", "x", "mean", "s").add("Mul", "s", "scale", "z").add("MatMul", "z", "w0", "h0")
    model.add("Tanh", "h0", "h1").add("Mul", "h1", "factor", "h2").add("Add", "summand", "h2", "h3")
    model.add("MatMul", "h3", "w1", "y")

    def act(observations):
        hidden = np.tanh((observations - mean) * scale @ model.arrays["w0"])
        return ((hidden * factor + summand) @ model.arrays["w1"]).clip(-1, 1)

    return model, act


def as_torch():
    """A module that normalises, scales and clamps, with numbers in Constant, for one vector."""
    model = Model((17,))
    model.constant("deviation", np.linspace(0.5, 2, 17, dtype=np.float32))
    for name, value in (("low", -0.5), ("high", 0.25), ("minus", -10.0), ("plus", 10.0)):
        model.add("Constant", name, value_float=value)
    model.add("Constant", "b2", value_floats=[0.5] * 6)
    model.add("Div", "x", "deviation", "z").add("Clip", "z", "minus", "plus", "n")
    model.add("MatMul", "n", "w0", "m0").add("Add", "b0", "m0", "h0").add("Tanh", "h0", "h1")
    model.add("MatMul", "h1", "w1", "m1").add("Sub", "b2", "m1", "h2")
    model.add("Mul", "h2", "high", "h3").add("Clip", "h3", "low", "high", "y")

    def act(observations):
        normal = (observations / model.arrays["deviation"]).clip(-10, 10)
        hidden = np.tanh(normal @ model.arrays["w0"] + model.arrays["b0"])
        return ((0.5 - hidden @ model.arrays["w1"]) * 0.25).clip(-0.5, 0.25)

    return model, act


@pytest.mark.parametrize(
    ("model", "act"),
    [
        ending_in_tanh(),
        as_skl2onnx(TensorProto.FLOAT),
        as_skl2onnx(TensorProto.DOUBLE),
        as_sb3(),
        as_tf2onnx(),
        as_torch(),
    ],
    ids=["Tanh", "skl2onnx", "skl2onnx in double", "sb3", "tf2onnx", "torch"],
)
@pytest.mark.parametrize("runtime", [True, False])
def test_reads_what_exporters_write(model, act, runtime, tmp_path, command, monkeypatch):
    if not runtime:
        monkeypatch.setitem(sys.modules, "onnxruntime", None)
    out = tmp_path / "walker.safetensors"
    said = command("convert", model.save(tmp_path / "model.onnx"), out).out
    assert said.startswith(f"{out}: Walker2d-v5, 2 layers; actions differ by at most ")
    observations = np.random.default_rng(1).normal(0, 1, (200, 17))
    found = np.empty((200, 6))
    _core.Policy(str(out)).act(observations, found)
    assert np.abs(found - act(observations)).max() < 1e-6
    assert np.std(found) > 0.1


def refused():
    """Models and what their errors say."""
    yield Model().add_layers().constant("b1", np.full(6, np.nan, np.float32)), "finite"
    yield Model().add_layers().constant("b1", np.zeros((6, 1), np.float32)), "shape (6, 1) for 6"
    yield Model().add_layers().constant("b1", np.zeros(6, np.int64)), "a constant of int64"
    yield Model().add_layers().constant("b1", np.array(["a"] * 6, object)), "constant of object"
    yield Model().add_layers().constant("w1", np.float32(1)), "a weight of shape ()"
    yield Model().add_layers().constant("w1", np.ones(20, np.float32)), "a weight of shape (20,)"
    yield Model().add_layers().constant("w1", np.ones((19, 6), np.float32)), "19 inputs after 20"
    yield Model().add_layers().constant("b1", np.ones(5, np.float32)), "shape (5,) for 6"
    smaller = Model().constant("w1", np.ones((20, 5), np.float32))
    yield (
        smaller.constant("b1", np.ones(5, np.float32)).add_layers(),
        "--id: is missing, and 17 observations and 5 ",
    )
    yield Model().add_layers(end="h2").add("Softmax", "h2", "y"), "has a node Softmax; must be"
    yield Model().add_layers(end="h2").add("Relu", "h2", "y"), "ends in Relu"
    yield Model().add_layers(end="h2").add("Cast", "h2", "y", to=TensorProto.INT64), "has a Cast"
    yield Model().add_layers(end="h2").add("Add", "h2", "h2", "y"), "Add with 2 inputs that"
    yield Model().add_layers(start="h3").add("Tanh", "x", "h3"), "Tanh that does not follow"
    yield Model().add_layers(start="h3").add("Clip", "x", "b0", "h3"), "limits observations"
    clipped = Model().constant("low", np.float32(-10)).constant("high", np.float32(10))
    clipped.add("Clip", "x", "low", "high", "h3").add("Mul", "h3", "high", "h4")
    yield clipped.add_layers(start="h4"), "normalises observations after their Clip"
    yield Model().add_layers(start="y"), "output y: has a cycle"
    yield Model().add_layers(end="z"), "output y: y does not depend on the input"
    yield Model().add_layers(start="z"), "output y: z does not depend on the input"
    yield Model().add("Identity", "b0", "y"), "output y: y does not depend on the input"
    yield Model().add("Identity", "x", "y"), "has no layer"
    yield Model().add("Gemm", "x", "w0", "h0").add("Gemm", "h0", "w1", "y"), "two layers without"
    yield Model(element=TensorProto.INT64).add_layers(), "input x: must be of float16, float32"
    yield Model(("n", 1, 17)).add_layers(), "output y: "
    several = Model().add_layers().add("Gemm", "h1", "w1", "deviation")
    several.outputs = ["y", "deviation"]
    yield several, "outputs ['y', 'deviation'], of which y and deviation fit"
    several = Model().add_layers().constant("w1", np.ones((20, 2), np.float32))
    several.outputs = ["y", "h1"]
    yield several, "outputs ['y', 'h1'], of which none fit"
    several = Model().add_layers()
    several.inputs = [*several.inputs, helper.make_tensor_value_info("z", TensorProto.FLOAT, None)]
    yield several, "has inputs x, z; must have one"
    nothing = Model()
    nothing.outputs = []
    yield nothing, "has outputs [], of which none fit"


@pytest.mark.parametrize(("model", "words"), [*refused()])
def test_error_names_what_a_graph_has(model, words, tmp_path, command):
    out = tmp_path / "walker.safetensors"
    out.write_bytes(b"earlier")
    error = command("convert", model.save(tmp_path / "model.onnx"), out, status=2).err
    assert words in error
    assert (f"{tmp_path / 'model.onnx'}: " in error) != ("--id" in words)
    assert out.read_bytes() == b"earlier"
