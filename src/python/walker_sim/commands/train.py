"""``train``: trains a policy with Stable-Baselines3 on many walkers at once."""

from __future__ import annotations

import dataclasses
import importlib
import json
import sys
from pathlib import Path
from typing import Any, Sequence

from walker_sim.commands import options as common
from walker_sim.commands.options import InputError
from walker_sim.files import package_file
from walker_sim.training.settings import Settings, SettingsError, read_settings

DESCRIPTION = """\
Trains a policy with Stable-Baselines3 and the settings tuned for the environment. It learns on
seeds that no evaluation uses; the policy that does best on seeds set apart is kept.
"""

EPILOG = f"""\
{common.WALKER_HELP}
In the folder: policy.safetensors (the best until now), curve.csv, curve.png, settings.yaml and a
checkpoint. Ctrl-C saves, and --resume goes on from there.

examples:
  python3 -m walker_sim train BipedalWalker-v3 --out walker
  python3 -m walker_sim evaluate BipedalWalker-v3 --policy walker/policy.safetensors
  python3 -m walker_sim train --resume walker
  python3 -m walker_sim train Walker2d-v5 --settings mine.yaml ctrl_cost_weight=0.01

Needs pip install 'walker_sim[train]'.
"""


def _parser() -> common.Parser:
    parser = common.Parser("train", DESCRIPTION, EPILOG)
    parser.add_argument(
        "walker", nargs="*", metavar="ID|NAME=VALUE", help="the environment; see below"
    )
    parser.add_argument(
        "--settings", type=Path, metavar="FILE", help="in place of those that come with the package"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="the folder (default: runs/ID)")
    parser.add_argument("--resume", type=Path, metavar="DIR", help="go on in a folder")
    parser.add_argument(
        "--steps", type=common.count, metavar="N", help="in place of the settings' number"
    )
    parser.add_argument(
        "--seed", type=common.count_or_zero, metavar="N", help="in place of the settings' seed"
    )
    parser.add_argument(
        "--num-threads",
        type=common.count,
        metavar="N",
        default=0,
        help="that learn and step walkers (default: one per processor)",
    )
    return parser


def run(arguments: Sequence[str]) -> int:
    options = _parser().parse_intermixed_args(arguments)
    threads = options.num_threads
    try:
        training_run: Any = importlib.import_module("walker_sim.training.run")
        torch: Any = importlib.import_module("torch")
        importlib.import_module("yaml")
    except ImportError as error:
        raise InputError(f"needs pip install 'walker_sim[train]' ({error})") from error
    env_id, settings, folder = _chosen(options)
    if threads:
        torch.set_num_threads(threads)
    folder.mkdir(parents=True, exist_ok=True)
    with _Display(settings.steps) as display:
        try:
            training = training_run.Training(
                env_id, settings, folder, num_threads=threads, report=display.show
            )
            if options.resume:
                training.resume()
        except (ValueError, AssertionError) as error:  # from the walkers or the learner
            raise InputError(str(error)) from error
        training.run()
        training.close()
    if not training.is_done:
        print(
            f"stopped after {training.steps:,} steps; to go on: "
            f"python3 -m walker_sim train --resume {folder}",
            file=sys.stderr,
        )
        return 130
    print(f"{folder / training_run.POLICY}: mean return {training.best:.1f} where it was chosen")
    return 0


def _chosen(options: Any) -> tuple[str, Settings, Path]:
    if options.resume:
        for name in ("walker", "settings", "out", "steps", "seed"):
            if getattr(options, name) not in (None, []):
                raise InputError(f"--resume goes on with what is there; {name} cannot be given too")
        return _resumed(options.resume)
    env_id, parameters = common.walker_of(options.walker)
    try:
        settings = read_settings(options.settings or settings_file(env_id))
    except SettingsError as error:
        raise InputError(str(error)) from error
    changes: dict[str, Any] = {"parameters": {**settings.parameters, **parameters}}
    for name in ("steps", "seed"):
        if getattr(options, name) is not None:
            changes[name] = getattr(options, name)
    folder = options.out or Path("runs") / env_id
    if (folder / "checkpoint").exists():
        raise InputError(f"--out {folder}: holds a training already; --resume {folder} goes on")
    return env_id, dataclasses.replace(settings, **changes), folder


def _resumed(folder: Path) -> tuple[str, Settings, Path]:
    state = folder / "checkpoint" / "state.json"
    if not state.exists():
        raise InputError(f"--resume {folder}: has no checkpoint")
    try:
        return _environment_of(state), read_settings(folder / "settings.yaml"), folder
    except (SettingsError, ValueError) as error:
        raise InputError(f"--resume {folder}: {error}") from error


def _environment_of(state: Path) -> str:
    """Returns the id in a checkpoint's file; ValueError if the content is invalid."""
    try:
        content = json.loads(state.read_text(encoding="utf-8"))
    except RecursionError as error:
        raise ValueError(f"{state}: no JSON: nested too deep") from error
    except ValueError as error:
        raise ValueError(f"{state}: no JSON: {error}") from error
    env_id = content.get("id") if isinstance(content, dict) else None
    if not isinstance(env_id, str):
        raise ValueError(f"{state}: must be an object with the environment's id")
    return env_id


def settings_file(env_id: str) -> Path:
    """Returns the settings file that ships with the package; InputError if there is none."""
    path = package_file(f"config/training/{env_id}.yaml")
    if path is None:
        raise InputError(f"{env_id}: no settings come with the package; give --settings FILE")
    return path


class _Display:
    """Progress bar on a terminal, and one line per evaluation."""

    def __init__(self, total: int) -> None:
        tqdm: Any = importlib.import_module("tqdm").tqdm
        # disable=None: no bar if standard error is not a terminal.
        self._bar = tqdm(total=total, unit=" steps", unit_scale=True, disable=None)

    def __enter__(self) -> _Display:
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.close()

    def show(self, training: Any, point: Any) -> None:
        """Updates the bar; prints a line if there is a new point. The training calls it."""
        returns = training.walkers.returns
        if returns:
            mean = sum(returns) / len(returns)
            self._bar.set_postfix_str(f"return {mean:.1f}", refresh=False)
        self._bar.update(training.steps - self._bar.n)
        if point is not None:
            line = (
                f"{point.steps:>12,} steps {point.seconds:8.0f} s   training "
                f"{point.training_return:8.1f}   evaluation {point.evaluation_return:8.1f} "
                f"± {point.deviation:.1f}, least {point.least:.1f}"
            )
            self._bar.write(line)
