"""``convert``: converts a trained model to a policy file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.commands import options as common
from walker_sim.commands.options import InputError
from walker_sim.registration import without_namespace
from walker_sim.training.policy_file import PolicyFile, write_policy

CHECKS = 1000
TOLERANCE = 1e-5

DESCRIPTION = """\
Makes FILE.safetensors of a model: of Stable-Baselines3's PPO, A2C, SAC or its contrib's TQC
(MODEL.zip), or of a network of fully connected layers in ONNX (MODEL.onnx). Then compares the
actions of both on random observations. A MODEL.zip can run code: open none that you do not trust.
"""

EPILOG = f"""\
{common.WALKER_HELP}
An ONNX model takes observations, shape (n, observation size), and gives actions: Gemm, or MatMul
and Add, between Tanh or Relu; a Tanh at the end is one that squashes. What it gives is clipped to
the action's limits.

examples:
  python3 -m walker_sim convert model.zip walker.safetensors --id BipedalWalker-v3
  python3 -m walker_sim convert model.zip walker.safetensors --id Walker2d-v5 \\
      --normalization vec_normalize.pkl
  python3 -m walker_sim evaluate Walker2d-v5 --policy walker.safetensors
"""

Actor = Callable[[NDArray[np.float32]], NDArray[np.float32]]
"""Maps normalised observations, shape (n, observation size), to actions, shape (n, action size)."""


def _parser() -> common.Parser:
    parser = common.Parser("convert", DESCRIPTION, EPILOG)
    parser.add_argument("model", type=Path, metavar="MODEL", help="MODEL.zip or MODEL.onnx")
    parser.add_argument("out", type=Path, metavar="OUT", help="FILE.safetensors")
    parser.add_argument(
        "--id", metavar="ID", help="the environment (default: the one it fits alone)"
    )
    parser.add_argument(
        "--normalization",
        type=Path,
        metavar="FILE.pkl",
        help="of observations: what VecNormalize.save wrote beside a MODEL.zip",
    )
    return parser


def run(arguments: Sequence[str]) -> int:
    options = _parser().parse_args(arguments)
    if options.out.suffix != ".safetensors":
        raise InputError(f"{options.out}: must end in .safetensors")
    if not options.model.is_file():
        raise InputError(f"{options.model}: there is no such file")
    from walker_sim.training import models

    try:
        if options.model.suffix == ".zip":
            model = models.read_sb3(options.model)
        elif options.model.suffix == ".onnx":
            model = models.read_onnx(options.model)
        else:
            raise InputError(f"{options.model}: must end in .zip or .onnx")
        env_id = without_namespace(options.id) if options.id else _fitting(model.sizes)
        specification = _core.Environment(env_id, {}).specification
        policy = models.to_policy(model, env_id, specification, options.normalization)
    except models.ModelError as error:
        raise InputError(f"{options.model}: {error}") from error
    except ImportError as error:
        raise InputError(
            f"{options.model}: needs {error.name}: pip install {error.name}"
        ) from error
    except ValueError as error:
        raise InputError(str(error)) from error
    write_policy(policy, options.out)
    difference = largest_difference(policy, options.out, model.act)
    print(
        f"{options.out}: {env_id}, {len(policy.layers)} layers; actions differ by at most"
        f" {difference:.2g} on {CHECKS} random observations"
    )
    if not difference <= TOLERANCE:
        print(f"more than {TOLERANCE:g}: this is another policy")
        return 1
    return 0


def largest_difference(policy: PolicyFile, path: Path, actor: Actor) -> float:
    """Returns the maximum difference between the actions of the written file and of the model."""
    size = len(policy.mean)
    normal = np.random.default_rng(0).normal(size=(CHECKS, size)).clip(-5, 5)
    observations = normal * policy.deviation + policy.mean
    expected = actor(normal.astype(np.float32))
    actions = np.empty_like(expected, np.float64)
    _core.Policy(os.fsencode(path)).act(observations, actions)
    return float(np.abs(actions - expected).max())


def _fitting(sizes: tuple[int, int]) -> str:
    """Returns the newest id whose spaces have these sizes; InputError unless one robot fits."""
    fitting: dict[str, Any] = {}
    for env_id in _core.ids():
        specification = _core.Environment(env_id, {}).specification
        found = len(specification["observation_low"]), len(specification["action_low"])
        if found == sizes:
            fitting[env_id.split("-")[0]] = env_id
    if len(fitting) != 1:
        names = ", ".join(fitting.values()) or "none of ours"
        raise InputError(
            f"--id: must be given, for {sizes[0]} observations and {sizes[1]} actions fit {names}"
        )
    return str(next(iter(fitting.values())))
