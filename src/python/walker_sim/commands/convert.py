"""``convert``: converts a trained model to a policy file, or a policy file to ONNX."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any, Sequence

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.commands import options as common
from walker_sim.commands.options import InputError
from walker_sim.files import replace_file
from walker_sim.registration import without_namespace
from walker_sim.training import models, onnx_file, onnx_reader
from walker_sim.training.policy_file import NO_HISTORY, PolicyFile, read_policy, to_bytes

CHECKS = 1000
TOLERANCE = 1e-5

DESCRIPTION = """\
Writes FILE.safetensors from a model of Stable-Baselines3's PPO, A2C or SAC or its contrib's TQC
(MODEL.zip), or from a network of fully connected layers in ONNX (MODEL.onnx). Writes FILE.onnx from
a policy file (MODEL.safetensors). Before it writes, it compares the actions of both on random
observations. Opening a MODEL.zip can run code: use only files that you trust.
"""

EPILOG = f"""\
{common.ID_HELP}.

MODEL.onnx maps one input, observations of shape (n, observation size), (1, observation size) or
(observation size), to actions. It consists of layers by Gemm, or by MatMul and Add, with Tanh or
Relu between them. It may normalise observations before them (Sub, Add, Mul, Div, then Clip to 10)
and scale and limit actions after them (a last Tanh, Add, Sub, Mul, Div, then Clip, Max, Min).
Without limits of its own, its output is clipped to the action's limits; if it ends in a Tanh,
scaled to them. Of several outputs, as those of Stable-Baselines3's PPO, one must have the actions'
size.
A MODEL.onnx that this command has written gives the same policy file again.

FILE.onnx has the input "observation", the environment's own observations of shape (n, observation
size) in their type, and the output "action", float32, within the action's limits. It contains the
normalisation. The input of a policy with a history is its latest observations and actions, which
the caller keeps.
A MODEL with k times as many inputs as --id has observations acts on the last k observations, as in
Stable-Baselines3's VecFrameStack.

examples:
  python3 -m walker_sim convert model.zip walker.safetensors --id BipedalWalker-v3
  python3 -m walker_sim convert model.zip walker.safetensors --id Walker2d-v5 \\
      --normalization vec_normalize.pkl
  python3 -m walker_sim evaluate Walker2d-v5 --policy walker.safetensors
  python3 -m walker_sim convert walker.safetensors walker.onnx
"""


def run(arguments: Sequence[str]) -> int:
    parser = common.Parser("convert", DESCRIPTION, EPILOG)
    parser.add_argument(
        "model", type=Path, metavar="MODEL", help="MODEL.zip, MODEL.onnx or MODEL.safetensors"
    )
    parser.add_argument("out", type=Path, metavar="OUT", help="FILE.safetensors or FILE.onnx")
    parser.add_argument(
        "--id", metavar="ID", help="the environment (default: the only robot that the model fits)"
    )
    parser.add_argument(
        "--normalization",
        type=Path,
        metavar="FILE.pkl",
        help="file of VecNormalize.save, with the statistics of a MODEL.zip's observations",
    )
    options = parser.parse_args(arguments)
    if not options.model.is_file():
        raise InputError(f"{options.model}: no such file")
    known = {".zip": ".safetensors", ".onnx": ".safetensors", ".safetensors": ".onnx"}
    suffix = known.get(options.model.suffix)
    if suffix is None:
        raise InputError(f"{options.model}: must end in .zip, .onnx or .safetensors")
    if options.out.suffix != suffix:
        raise InputError(f"{options.out}: must end in {suffix} if made from {options.model}")
    try:
        status = _to_onnx(options) if suffix == ".onnx" else _to_policy(options)
    except (models.ModelError, ImportError) as error:
        raise InputError(f"{options.model}: {error}") from error
    except ValueError as error:
        raise InputError(str(error)) from error
    return status


def _to_policy(options: argparse.Namespace) -> int:
    env_id = without_namespace(options.id) if options.id else ""
    sizes = {each: _sizes_of(each) for each in ([env_id] if env_id else _core.ids())}
    if options.model.suffix == ".zip":
        model = models.read_sb3(options.model)
    else:
        model = onnx_reader.read_onnx(options.model, sizes.values())
    env_id = env_id or model.env_id or _fitting(model.sizes, sizes)
    specification = _core.Pool(env_id, {}).specification
    policy = models.to_policy(model, env_id, specification, options.normalization)
    content = to_bytes(policy)
    network = _core.Policy.from_bytes(os.fsencode(options.model), content)
    # Within the range that the policy does not clip.
    inputs = np.random.default_rng(0).normal(size=(CHECKS, len(policy.mean))).clip(-5, 5)
    observations = inputs * policy.deviation + policy.mean
    if model.normalization is not None:
        inputs = observations = observations.astype(np.float32)  # equal for each type of the model
    expected = model.act(inputs.astype(np.float32)).clip(policy.low, policy.high)
    difference = max_difference(network, observations, expected)
    return _write(options.out, content, policy, difference, "random observations")


def _to_onnx(options: argparse.Namespace) -> int:
    for name in ("id", "normalization"):
        if getattr(options, name) is not None:
            raise InputError(f"--{name}: not allowed with {options.model}, which contains it")
    policy = read_policy(options.model)
    dtype = _core.Pool(policy.env_id, {}).specification["observation_dtype"]
    model = onnx_file.to_model(policy, dtype)
    evaluator, act = onnx_file.load_onnx(model, "observation", "action")
    # Half of them are as wide as those of an episode. The others are so wide that some are clipped,
    # as a fall's are.
    width = np.repeat([1.0, 5.0], CHECKS // 2)[:, np.newaxis]
    normal = np.random.default_rng(0).normal(size=(CHECKS, len(policy.mean))) * width
    observations = (normal * policy.deviation + policy.mean).astype(dtype)
    network = _core.Policy(os.fsencode(options.model))
    difference = max_difference(network, observations, act(observations))
    where = f"random observations ({evaluator})"
    return _write(options.out, model.SerializeToString(), policy, difference, where)


def _write(out: Path, content: bytes, policy: PolicyFile, difference: float, where: str) -> int:
    """Writes the file unless it is another policy, and prints the difference."""
    if difference <= TOLERANCE:
        replace_file(out, content)
    history = ""
    if policy.history != NO_HISTORY:
        history = ", acts on its last {} observations and {} actions".format(*policy.history)
    print(
        f"{out}: {policy.env_id}, {len(policy.layers)} layers{history}; actions differ by at most"
        f" {difference:.2g} on {CHECKS} {where}"
    )
    if not difference <= TOLERANCE:
        print(f"the difference is above {TOLERANCE:g}, so {out} is not written")
        return 1
    return 0


def max_difference(
    network: _core.Policy, observations: NDArray[Any], expected: NDArray[Any]
) -> float:
    """Returns the maximum difference between the policy's actions and the expected ones for
    observations, shape (n, observation size)."""
    actions = np.empty((len(observations), network.action_size))
    network.act(observations.astype(np.float64), actions)
    return float(np.abs(actions - expected).max())


def _sizes_of(env_id: str) -> tuple[int, int]:
    """Returns the sizes of observations and actions."""
    specification = _core.Pool(env_id, {}).specification
    return len(specification["observation_low"]), len(specification["action_low"])


def _fitting(sizes: tuple[int, int], of_ids: dict[str, tuple[int, int]]) -> str:
    """Returns the newest id whose spaces have these sizes; InputError unless one robot fits."""
    fitting: dict[str, str] = {}
    for env_id, known in of_ids.items():
        if sizes == known:
            fitting[env_id.split("-")[0]] = env_id
    if len(fitting) != 1:
        names = ", ".join(fitting.values()) or "no environment"
        raise InputError(
            f"--id: is missing, and {sizes[0]} observations and {sizes[1]} actions fit {names}"
        )
    return next(iter(fitting.values()))
