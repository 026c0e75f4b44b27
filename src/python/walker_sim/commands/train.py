"""``train``: trains a policy on many walkers at once."""

from __future__ import annotations

import argparse
import dataclasses
import functools
import importlib
import sys
from pathlib import Path
from typing import Any, Sequence

from walker_sim import _core
from walker_sim.commands import options as common
from walker_sim.commands.options import InputError
from walker_sim.files import naming, package_file
from walker_sim.training.policy_file import read_policy
from walker_sim.training.settings import EVOLUTIONARY, Settings, settings_from
from walker_sim.training.settings_file import read_settings
from walker_sim.training.stage import (
    CHECKPOINT,
    CURVE,
    EARLIER,
    PICTURE,
    POLICY,
    SETTINGS,
    STATE,
    checkpoint_of,
    read_state,
)
from walker_sim.worlds import to_world

DESCRIPTION = """\
Trains a policy with Stable-Baselines3 or by evolution strategies, with the settings that the
package includes for ID. Training and evaluations use separate seeds; the policy with the best
evaluation is kept.
"""

EPILOG = f"""\
{common.WALKER_HELP}
The folder gets policy.safetensors (the best so far), curve.csv, curve.png, settings.yaml and a
checkpoint. Ctrl-C saves a checkpoint, from which --resume continues. A checkpoint contains pickles,
which can run code: resume only trainings that you trust.

examples:
  python3 -m walker_sim train BipedalWalker-v3 --out walker
  python3 -m walker_sim evaluate BipedalWalker-v3 --policy walker/policy.safetensors
  python3 -m walker_sim train --resume walker
  python3 -m walker_sim train Walker2d-v5 --settings mine.yaml ctrl_cost_weight=0.01

Needs pip install 'walker_sim[train]'.
"""


def _parser() -> common.Parser:
    parser = common.Parser("train", DESCRIPTION, EPILOG)
    common.add_walker(parser)
    common.add_world(parser, "the settings'")
    parser.add_argument(
        "--settings", type=Path, metavar="FILE", help="YAML file (default: the package's for ID)"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder for the results (default: runs/ID)"
    )
    parser.add_argument(
        "--resume", type=Path, metavar="DIR", help="continue the training in this folder"
    )
    parser.add_argument(
        "--steps",
        type=common.count,
        metavar="N",
        help="total steps, in one stage instead of the settings' stages (default: the settings')",
    )
    parser.add_argument(
        "--seed", type=common.count_or_zero, metavar="N", help="seed (default: the settings')"
    )
    parser.add_argument(
        "--num-threads",
        type=common.count,
        metavar="N",
        default=0,
        help="threads that learn and that step walkers (default: one per processor)",
    )
    return parser


def run(arguments: Sequence[str]) -> int:
    options = _parser().parse_intermixed_args(arguments)
    threads = options.num_threads
    try:
        tqdm: Any = importlib.import_module("tqdm").tqdm
        for package in ("yaml", "matplotlib"):
            importlib.import_module(package)
        env_id, settings, folder, first = (_resumed if options.resume else _new)(options)
        stages = [
            stage_class(settings.stage(index), threads)
            for index in range(first, settings.num_stages)
        ]
    except ImportError as error:
        raise InputError(f"needs pip install 'walker_sim[train]' ({error})") from error
    except ValueError as error:  # of the settings or the world
        raise InputError(str(error)) from error
    folder.mkdir(parents=True, exist_ok=True)
    # disable=None: no bar if standard error is not a terminal.
    total = settings.steps_before(settings.num_stages)
    with tqdm(total=total, unit=" steps", unit_scale=True, disable=None) as bar:
        show = functools.partial(_show, bar)
        for index, stage in enumerate(stages, first):
            try:
                training = stage(
                    env_id, settings, folder, index=index, num_threads=threads, report=show
                )
                if options.resume and index == first and read_state(folder)["stage"] == index:
                    _resume(training)
            except (ValueError, TypeError, AssertionError) as error:  # from walkers or learner
                raise InputError(str(error)) from error
            with naming(folder):
                training.run()
            training.close()
            is_last = index + 1 == settings.num_stages
            if not training.is_complete or (training.wants_to_stop and not is_last):
                print(
                    f"stopped after {training.all_steps:,} steps; to continue: "
                    f"python3 -m walker_sim train --resume {folder}",
                    file=sys.stderr,
                )
                return 130
    is_min = len(training.goal.mixture) > 1 and training.settings.keep_best_by == "min"
    what = "least mean return of its worlds" if is_min else "mean return"
    print(f"{folder / POLICY}: {what} {training.best:.1f} in its evaluation")
    return 0


def _resume(training: Any) -> None:
    try:
        training.resume()
        made_for = training.policy().env_id
        if made_for != training.env_id:
            raise ValueError(f"id = {training.env_id}: must be {made_for}")
    except Exception as error:  # the files of other libraries may be damaged in any way
        raise InputError(
            f"--resume {training.folder}: not a checkpoint of these settings: "
            f"{type(error).__name__}: {error}"
        ) from error


def stage_class(settings: Settings, num_threads: int) -> Any:
    """Returns the class of a stage; ImportError if it needs a package that is not installed."""
    if settings.algorithm in EVOLUTIONARY:
        if settings.algorithm == "cma":
            importlib.import_module("cma")
        return importlib.import_module("walker_sim.training.es").Evolution
    torch: Any = importlib.import_module("torch")
    if num_threads:
        torch.set_num_threads(num_threads)
    return importlib.import_module("walker_sim.training.run").Training


def _new(options: argparse.Namespace) -> tuple[str, Settings, Path, int]:
    env_id, parameters = common.walker_of(options.walker)
    settings = read_settings(options.settings or settings_file(env_id))
    changes: dict[str, Any] = {}
    if parameters:
        changes["parameters"] = {**settings.parameters, **parameters}
    if options.world is not None:
        changes["world"] = to_world(env_id, options.world)
    for name in changes:
        if any(name in stage for stage in settings.stages):
            raise InputError(
                f"{name} = {changes[name]}: a stage of the settings has its own; "
                "use --settings FILE"
            )
    if options.seed is not None:
        changes["seed"] = options.seed
    if options.steps is not None:
        changes.update(steps=options.steps, stages=[])
    folder = options.out or Path("runs") / env_id
    if (checkpoint_of(folder) / STATE).exists():
        raise InputError(f"--out {folder}: has a training, which --resume {folder} continues")
    for name in (CHECKPOINT, *EARLIER, POLICY, CURVE, PICTURE):
        if (folder / name).exists():
            raise InputError(f"--out {folder}: has {name}; must be a folder without it")
    settings = settings_from({**dataclasses.asdict(settings), **changes})
    file = folder / SETTINGS
    if file.exists() and read_settings(file) != settings:
        raise InputError(f"--out {folder}: has {SETTINGS} with other settings; must have none")
    return env_id, settings, folder, 0


def _resumed(options: argparse.Namespace) -> tuple[str, Settings, Path, int]:
    for name in ("walker", "world", "settings", "out", "steps", "seed"):
        if getattr(options, name) not in (None, []):
            raise InputError(f"--resume {options.resume}: not allowed with {name}")
    folder = options.resume
    file = checkpoint_of(folder) / STATE
    if not file.exists():
        raise InputError(f"--resume {folder}: has no checkpoint")
    try:
        state = read_state(folder)
        env_id, stage = str(state["id"]), int(state["stage"])
        if env_id not in _core.ids():
            raise ValueError(f"id = {_core.shown(env_id)}: must be one of {', '.join(_core.ids())}")
        # The state of an earlier version has no points.
        for name in ("stage", "steps", "steps_before", "seconds", "best", "points"):
            value = state.get(name, 0) if name == "points" else state[name]
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                raise TypeError(f"{name} = {value!r}: must be a number")
        if not isinstance(state["is_done"], bool):
            raise TypeError(f"is_done = {state['is_done']!r}: must be true or false")
    except (RecursionError, ArithmeticError, LookupError, TypeError, ValueError) as error:
        raise InputError(
            f"--resume {folder}: {file}: not a checkpoint: {type(error).__name__}: {error}"
        ) from error
    # Another environment's sizes may be equal, e.g. Hopper-v4's and Hopper-v5's.
    made_for = read_policy(folder / POLICY).env_id if (folder / POLICY).exists() else env_id
    if made_for != env_id:
        raise InputError(f"--resume {folder}: {file}: id = {env_id}: must be {made_for}")
    settings = read_settings(folder / SETTINGS)
    if not 0 <= stage < settings.num_stages:
        raise InputError(
            f"--resume {folder}: {file}: stage = {stage}: must be one of the {settings.num_stages} "
            "of these settings, from 0"
        )
    return env_id, settings, folder, min(stage + bool(state["is_done"]), settings.num_stages - 1)


def settings_file(env_id: str) -> Path:
    """Returns the settings file that ships with the package; InputError if there is none."""
    path = package_file(f"config/training/{env_id}.yaml")
    if path is None:
        raise InputError(f"{env_id}: the package has no settings for it; use --settings FILE")
    return path


def _show(bar: Any, training: Any, point: Any) -> None:
    """Updates the progress bar; prints a line if there is a new point of the curve."""
    grown = f", ranges {training.curriculum.progress:.0%}" if training.curriculum else ""
    bar.set_postfix_str(f"return {training.mean_return:.1f}{grown}", refresh=False)
    bar.update(training.all_steps - bar.n)
    if point is not None:
        bar.write(
            f"{point.steps:>12,} steps {point.seconds:8.0f} s   training "
            f"{point.training_return:8.1f}   evaluation {point.evaluation_return:8.1f} "
            f"± {point.deviation:.1f}, min {point.least:.1f}"
            + (f"   in {point.world}" if training.curriculum else "")
            + "".join(f"\n{mean:>14.1f} in {name}" for name, mean in point.means.items())
        )
