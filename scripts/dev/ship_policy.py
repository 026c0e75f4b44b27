#!/usr/bin/env python3
"""Adds a finished training to the package: its policy, settings, curve, and a card with its gait.

  ./scripts/env python3 scripts/dev/ship_policy.py runs/Walker2d-v5 --on "two cores"

The card's returns are those of `python3 -m walker_sim evaluate ID --policy shipped --seeds
1000000:1001000`, which a test repeats.
"""

import argparse
import json
import os
import pathlib
import re
import shutil
import sys
import tempfile

import gymnasium
import numpy as np
from PIL import Image
from walker_sim import _core
from walker_sim.commands import main as walker_sim
from walker_sim.commands.policies import acting, shipped_policy
from walker_sim.training.curve import read_curve
from walker_sim.training.policy_file import read_policy
from walker_sim.training.settings_file import read_settings
from walker_sim.training.stage import FIRST_CHOICE_SEED

ROOT = pathlib.Path(__file__).resolve().parents[2]
SEEDS = "1000000:1001000"
BEGIN, END = "<!-- cards begin: written by scripts/dev/ship_policy.py -->", "<!-- cards end -->"
RETURNS = r"^\| (\*\*.+\*\*) \| (.+) \| (.+) \| (.+) \| (.+) \|$"

CARD = """\
# {name}

`python3 -m walker_sim train {trained}{option}` with
[config/training/{settings_name}.yaml](../../config/training/{settings_name}.yaml) made
`assets/policies/{name}.safetensors`.

| | |
|---|---|
| stages | {stages}, seed {seed} |
| network | {layers}, {activation} |
| steps | {steps:,}; best evaluation, on seeds {first} to {last}, after {chosen:,} |
| wall time | {minutes:.0f} min on {machine} |
| settings' SHA-256 | `{settings}` |
{worlds}
Returns over the 1000 seeds 1000000 to 1000999, which training does not use:

| mean | deviation | least | most | ends |
|---|---|---|---|---|
| **{mean:.1f}** | {standard_deviation:.1f} | {least:.1f} | {most:.1f} | {ends} |

`python3 -m walker_sim evaluate {id} --policy {kind} --seeds {seeds}` prints them.

![0.8 s of its gait, from step 200]({name}_gait.png)

![Returns over steps]({name}.png)
"""

FIRST_STEP, PICTURES, SECONDS = 200, 8, 0.8  # of the gait


def evaluate(env_id, kind):
    """Returns the command's summary for the shipped policy of a kind."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder, "evaluation.json")
        options = ["--policy", kind, "--seeds", SEEDS, "--json", str(path)]
        if walker_sim(["evaluate", env_id, *options]) != 0:
            sys.exit(1)
        return json.loads(path.read_text())


def draw_gait(env_id, kind, path):
    """Draws SECONDS of the shipped policy's episode as pictures side by side."""
    camera = {} if env_id.startswith("Bipedal") else {"camera_name": "track"}
    environment = gymnasium.make(f"walker_sim/{env_id}", render_mode="rgb_array", **camera)
    policy = _core.Policy(str(shipped_policy(env_id, kind)))
    act = acting(policy, policy.action_size)
    observation, _ = environment.reset(seed=1_000_000)
    every = max(round(SECONDS / PICTURES / environment.unwrapped.dt), 1)
    pictures = []
    for step in range(FIRST_STEP + PICTURES * every):
        observation, *_ = environment.step(act(observation).astype(np.float32))
        if step >= FIRST_STEP and (step - FIRST_STEP) % every == 0:
            pictures.append(cropped(environment.render()))
    strip = Image.fromarray(np.concatenate(pictures, axis=1))
    strip.quantize(64).save(path, optimize=True)


def cropped(picture):
    """Returns the part of a picture that shows the walker."""
    height, width, _ = picture.shape
    if width > height:  # BipedalWalker stands in the left third
        return picture[height * 2 // 5 : height * 9 // 10, : height // 2]
    return picture[height // 4 :: 2, width // 4 : width * 3 // 4 : 2]


def worlds_of(stage, last):
    """Returns the card's lines about the worlds of a training: its only one, or the mixture."""
    parts = stage.mixture
    if len(parts) == 1:
        world = _core.world_text(parts[0].world)
        return f"| world | `{world}` |\n" if parts[0].world else ""
    lines = [
        "\nIts [mixture of worlds](../training.md#mixtures-of-worlds), the share of the walkers in"
        f" each, and mean returns over {stage.evaluation_episodes} episodes at the end:\n",
        "| world | share | mean return |",
        "|---" * 3 + "|",
    ]
    total = sum(part.weight for part in parts)
    for part in parts:
        text = _core.world_text(part.world)
        is_preset = part.name in _core.world_presets()
        world = f"{part.name}: `{text}`" if part.world and not is_preset else f"`{part.name}`"
        share = f"{part.weight / total:.0%}" if part.weight else "none"
        lines.append(f"| {world} | {share} | {last.means[part.name]:.0f} |")
    return "\n".join([*lines, ""])


def write_table(cards):
    """Writes the cards' results into docs/policies.md."""
    lines = [
        "| policy | mean return | deviation | least | ends | steps | wall time |",
        "|---" * 7 + "|",
    ]
    for card in sorted(cards.glob("*.md")):
        text = card.read_text()
        mean, deviation, least, _, ends = re.search(RETURNS, text, re.MULTILINE).groups()
        steps = re.search(r"^\| steps \| ([0-9,]+);", text, re.MULTILINE)[1]
        time = re.search(r"^\| wall time \| ([0-9]+ min)", text, re.MULTILINE)[1]
        link = f"[{card.stem}](policies/{card.name})"
        lines.append(f"| {link} | {mean} | {deviation} | {least} | {ends} | {steps} | {time} |")
    page = ROOT / "docs" / "policies.md"
    before, rest = page.read_text().split(BEGIN)
    after = rest.split(END)[1]
    page.write_text("\n".join([before + BEGIN, *lines, END + after]))


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("run", type=pathlib.Path, help="folder of the training")
    parser.add_argument(
        "--on", required=True, metavar="WHAT", help="machine of the training, for the card"
    )
    parser.add_argument("--also", metavar="ID", help="ship it for this environment instead")
    parser.add_argument(
        "--robust", action="store_true", help="ship it beside the present one, as ID-robust"
    )
    arguments = parser.parse_args()
    run = arguments.run
    policy = _core.Policy(os.fsencode(run / "policy.safetensors"))
    notes = policy.notes
    env_id = arguments.also or policy.id
    kind, suffix = ("robust", "-robust") if arguments.robust else ("shipped", "")
    name, settings_name = env_id + suffix, policy.id + suffix
    cards = ROOT / "docs" / "policies"
    cards.mkdir(exist_ok=True)
    shutil.copy(run / "policy.safetensors", ROOT / "assets/policies" / f"{name}.safetensors")
    file = ROOT / "config/training" / f"{settings_name}.yaml"
    # An equal file may have comments, so it is kept.
    if not file.exists() or read_settings(file).hash() != notes["settings"]:
        shutil.copy(run / "settings.yaml", file)
    settings = read_settings(file)
    shutil.copy(run / "curve.png", cards / f"{name}.png")
    summary = evaluate(env_id, kind)
    ends = [outcome["end"] for outcome in summary["outcomes"]]
    last = read_curve(run / "curve.csv")[-1]
    draw_gait(env_id, kind, cards / f"{name}_gait.png")
    network = read_policy(run / "policy.safetensors")
    sizes = [policy.input_size, *(len(bias) for _, bias in network.layers)]
    stages = [settings.stage(index) for index in range(settings.num_stages)]
    text = CARD.format(
        id=env_id,
        name=name,
        kind=kind,
        settings_name=settings_name,
        option=f" --settings config/training/{settings_name}.yaml" if suffix else "",
        worlds=worlds_of(stages[-1], last),
        trained=policy.id,
        stages=", then ".join(
            f"{stage.algorithm.upper()} ({stage.steps / 1e6:g} M steps)" for stage in stages
        ),
        seed=notes["seed"],
        layers="-".join(map(str, sizes)),
        activation=network.activation,
        steps=last.steps,
        first=FIRST_CHOICE_SEED,
        last=FIRST_CHOICE_SEED + stages[-1].evaluation_episodes - 1,
        chosen=int(notes["steps"]),
        minutes=last.seconds / 60,
        machine=arguments.on,
        settings=notes["settings"],
        ends=", ".join(f"{ends.count(end) / len(ends):.1%} {end}" for end in sorted(set(ends))),
        seeds=SEEDS,
        **{name: summary[name] for name in ("mean", "standard_deviation", "least", "most")},
    )
    (cards / f"{name}.md").write_text(text)
    write_table(cards)
    print(cards / f"{name}.md")


if __name__ == "__main__":
    main()
