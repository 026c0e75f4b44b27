"""train with evolution strategies: stages, resuming to the bit, and the optimiser's formula."""

import json
import os
import shutil
import signal
import sys

import numpy as np
import pytest
from walker_sim import _core
from walker_sim.training import stage
from walker_sim.training.curve import read_curve
from walker_sim.training.es import AdamStrategy, Evolution
from walker_sim.training.policy_file import to_bytes, write_policy
from walker_sim.training.settings import settings_from
from walker_sim.training.settings_file import read_settings, write_settings
from walkers import ctrl_c

ID = "Hopper-v5"
SMALL = {
    "algorithm": "es",
    "steps": 20_000,
    "layers": [],
    "population": 8,
    "sigma": [0.1, 0.05],
    "learning_rate": [0.05, 0.02],
    "evaluate_every": 6_000,
    "evaluation_episodes": 5,
    "parameters": {"max_episode_steps": 100},
}
STAGES = [{"layers": [5], "steps": 8_000, "episodes": 2, "common_seeds": False}]


def evolve(folder, settings, index=0, num_threads=1, stops_after=None):
    folder.mkdir(exist_ok=True)
    training = Evolution(ID, settings, folder, index=index, num_threads=num_threads)
    if (folder / "checkpoint").exists() and stage.read_state(folder)["stage"] == index:
        training.resume()

    def look(training, point):
        if stops_after is not None and training.steps >= stops_after:
            training.wants_to_stop = True

    training.report = look
    training.run()
    training.close()
    return training


def test_learns_to_hop(tmp_path):
    training = evolve(tmp_path, settings_from({**SMALL, "steps": 60_000}))
    first, last = training.points[0], training.points[-1]
    assert last.evaluation_return > 1.3 * first.evaluation_return
    assert training.best == max(point.evaluation_return for point in training.points)


GROWING = {
    "world": {"gravity": [-12, -9.81]},
    "curriculum": {"thresholds": [0, 30], "moves": 50, "episodes": 2},
}


def check_interruptions(folder, monkeypatch, **changes):
    """SIGINT in any of the plays of updates, evaluations and trials must leave no trace, nor may
    another number of threads."""
    settings = settings_from({**SMALL, "steps": 2_000, "evaluate_every": 900, **changes})
    calls = []

    def play(*given, play=stage.play_jobs):
        calls.append(given)
        if cut and len(calls) % 3 == 1:  # so that an update and its trial can succeed
            os.kill(os.getpid(), signal.SIGINT)
        return play(*given)

    monkeypatch.setattr(stage, "play_jobs", play)
    outcomes = []
    for cut in (False, True):
        for index in range(settings.num_stages):
            training = evolve(folder / str(cut), settings, index, 1 + cut)
            while not training.is_complete:
                assert training.wants_to_stop and cut
                training = evolve(folder / str(cut), settings, index, 1 + cut)
        points = read_curve(folder / str(cut) / "curve.csv")
        curve = [(point.steps, point.evaluation_return, point.training_return) for point in points]
        kept = (folder / str(cut) / "policy.safetensors").read_bytes()
        outcomes.append((str(curve), kept, to_bytes(training.policy())))
    assert outcomes[0] == outcomes[1]


@pytest.mark.parametrize(
    "changes",
    [
        {"stages": [{"steps": 2_000, **GROWING}]},
        {"evaluate_every": 150, "episodes": 3},  # about as often as updates
        {"average_updates": 3, "stages": [{"start_weight": 0.25, "steps": 2_000, **GROWING}]},
        {"stages": [{**STAGES[0], "steps": 2_000, "max_difference": 30.0}]},
    ],
    ids=["growing", "evaluated", "averaged", "own seeds"],
)
def test_interrupted_episodes_are_repeated(tmp_path, monkeypatch, changes):
    check_interruptions(tmp_path, monkeypatch, **changes)


def test_ctrl_c_ends_episodes_without_end(tmp_path):
    endless = {"max_episode_steps": 0, "terminate_when_unhealthy": False}
    training = Evolution(ID, settings_from({**SMALL, "parameters": endless}), tmp_path)
    with ctrl_c(0.3):
        training.run()
    assert (training.steps, stage.read_state(tmp_path)["steps"]) == (0, 0)


def test_a_second_ctrl_c_does_not_end_the_checkpoint(tmp_path):
    sent = []

    class Interrupted(Evolution):
        def interrupt(self):
            sent.append(self._is_playing)
            os.kill(os.getpid(), signal.SIGINT)

        def __setattr__(self, name, value):
            if name == "_is_playing" and getattr(self, "_began", 0) and not value and not sent:
                self.interrupt()  # as `play` is ending
            super().__setattr__(name, value)

        def save(self, folder):
            self.interrupt()
            super().save(folder)

    training = Interrupted(ID, settings_from(SMALL), tmp_path)
    training.run()
    training.close()
    assert sent == [True, False]
    assert training.wants_to_stop
    assert stage.read_state(tmp_path)["steps"] == 0


def test_killed_in_a_checkpoint_keeps_a_complete_one(tmp_path):
    """A child process is killed at each of its calls that change files in turn."""
    settings = settings_from({**SMALL, "steps": 100})
    training = evolve(tmp_path / "first", settings)

    def save_and_die(number):
        rest = iter(range(number))

        def hook(event, arguments):
            changes_files = event in ("open", "os.mkdir", "os.rename", "os.remove", "os.rmdir")
            if changes_files and next(rest, None) is None:
                os.kill(os.getpid(), signal.SIGKILL)

        sys.addaudithook(hook)
        training.save_checkpoint()

    status, number = signal.SIGKILL, 0
    while status == signal.SIGKILL:
        training.folder = tmp_path / str(number)
        shutil.copytree(tmp_path / "first", training.folder)
        child = os.fork()
        if child == 0:
            try:
                save_and_die(number)
            finally:
                os._exit(0)
        status = os.waitpid(child, 0)[1]
        resumed = Evolution(ID, settings, training.folder)
        resumed.resume()
        assert resumed.steps == training.steps
        resumed.save_checkpoint()
        assert len([*(training.folder / "checkpoint").iterdir()]) == 2  # the state and its slot
        number += 1
    assert (status, number > 6) == (0, True)


def test_killed_before_a_checkpoint_adds_no_point_twice(tmp_path, monkeypatch):
    def die(training):
        raise KeyboardInterrupt

    settings = settings_from({**SMALL, "steps": 5_000, "evaluate_every": 2_000})
    whole = evolve(tmp_path / "whole", settings)
    evolve(tmp_path / "cut", settings, stops_after=3_000)
    for _ in range(2):
        with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
            patch.setattr(Evolution, "save_checkpoint", die)
            evolve(tmp_path / "cut", settings)
    unfinished, others = (tmp_path / "cut" / f"curve.csv.{one}.new" for one in (8 * "a", "mine"))
    unfinished.touch()
    others.touch()
    resumed = evolve(tmp_path / "cut", settings)
    curves = [read_curve(tmp_path / name / "curve.csv") for name in ("whole", "cut")]
    points = [[(point.steps, point.evaluation_return) for point in curve] for curve in curves]
    assert points[0] == points[1]
    assert resumed.best == whole.best
    assert (unfinished.exists(), others.exists()) == (False, True)


@pytest.mark.parametrize("kept", ["checkpoint.new", "checkpoint.old"])
def test_resumes_what_an_earlier_version_left(tmp_path, command, kept):
    """It was killed between the two renames of a checkpoint without slots."""
    settings = settings_from({**SMALL, "steps": 3_000})
    evolve(tmp_path, settings, stops_after=1)
    state = stage.read_state(tmp_path)
    (tmp_path / "checkpoint" / state.pop("files")).rename(tmp_path / kept)
    del state["points"]
    (tmp_path / kept / "state.json").write_text(json.dumps(state))
    shutil.rmtree(tmp_path / "checkpoint")
    error = command("train", ID, "--out", tmp_path, status=2).err
    assert f"--resume {tmp_path} continues" in error
    command("train", "--resume", tmp_path, "--num-threads", 1)
    assert stage.read_state(tmp_path)["is_done"]
    assert (tmp_path / kept / "state.json").exists()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        *((name, "; must be a folder without it") for name in ("checkpoint.old", "curve.csv")),
        ("policy.safetensors", "; must be a folder without it"),
        ("settings.yaml", " with other settings; must have none"),
    ],
)
def test_a_new_training_overwrites_nothing(tmp_path, command, name, words):
    (tmp_path / name).write_text("seed: 1234")
    error = command("train", ID, "--out", tmp_path, status=2).err
    assert f"--out {tmp_path}: has {name}{words}" in error
    assert [path.read_text() for path in tmp_path.iterdir()] == ["seed: 1234"]


def assert_refuses_another_id(folder, command):
    """Also between two stages: Hopper-v4 has the same sizes."""
    state = folder / "checkpoint/state.json"
    text = state.read_text()
    state.write_text(text.replace(ID, "Hopper-v4"))
    error = command("train", "--resume", folder, status=2).err
    assert f"id = Hopper-v4: must be {ID}" in error
    state.write_text(text)


def test_command_runs_the_stages_and_resumes_between_them(tmp_path, command, monkeypatch):
    settings = settings_from({**SMALL, "stages": STAGES})
    write_settings(settings, tmp_path / "settings.yaml")
    given = ["--settings", tmp_path / "settings.yaml", "--num-threads", 1]
    command("train", ID, *given, "--out", tmp_path / "run")

    def save_and_interrupt(training, folder, save=Evolution.save):
        save(training, folder)
        if training.is_done:
            os.kill(os.getpid(), signal.SIGINT)

    with monkeypatch.context() as patch:
        patch.setattr(Evolution, "save", save_and_interrupt)
        error = command("train", ID, *given, "--out", tmp_path / "cut", status=130).err
    assert f"--resume {tmp_path / 'cut'}" in error
    assert stage.read_state(tmp_path / "cut")["is_done"]
    assert_refuses_another_id(tmp_path / "cut", command)
    command("train", "--resume", tmp_path / "cut", "--num-threads", 1)
    one, other = ((tmp_path / name / "policy.safetensors").read_bytes() for name in ("run", "cut"))
    assert one == other
    policy = _core.Policy(str(tmp_path / "run/policy.safetensors"))
    assert policy.notes["settings"] == settings.hash()
    steps = [point.steps for point in read_curve(tmp_path / "run/curve.csv")]
    assert steps == sorted(steps)
    assert steps[-1] >= 28_000
    assert_refuses_another_id(tmp_path / "run", command)


def test_command_line_changes_a_training_with_stages(tmp_path, command):
    def given(stages):
        write_settings(settings_from({**SMALL, "stages": stages}), tmp_path / "mine.yaml")
        return ["train", ID, "--settings", tmp_path / "mine.yaml", "--out", tmp_path / "run"]

    own = [{"world": {"gravity": -9}, "parameters": {}}]
    for words, name in ((["--world", "{gravity: -5}"], "world"), (["ctrl_cost_weight=1"], "param")):
        error = command(*given(own), *words, status=2).err
        assert name in error
        assert "a stage of the settings has its own; use --settings FILE" in error
    assert not (tmp_path / "run").exists()
    command(*given(STAGES), "--steps", 1_000, "--world", "{gravity: -9}", "--num-threads", 1)
    settings = read_settings(tmp_path / "run/settings.yaml")
    assert (settings.steps, list(settings.stages)) == (1_000, [])
    assert dict(settings.world) == {"gravity": (-9, -9)}


def test_a_linear_policy_continues_in_a_layer(tmp_path):
    """At first the layer's actions are nearly the linear policy's."""
    evolve(tmp_path, settings_from(SMALL))
    linear = _core.Policy(str(tmp_path / "policy.safetensors"))
    following = Evolution(ID, settings_from({**SMALL, "stages": STAGES}), tmp_path, index=1)
    layer = _core.Policy.from_bytes("layer", to_bytes(following.policy()))
    actions = np.empty((2, 3))
    for each, row in zip((linear, layer), actions):
        each.act(np.full(11, 0.1), row)
    assert np.abs(actions).max() > 0.1
    assert np.allclose(*actions, rtol=0.05, atol=0.01)


def test_a_policy_is_partly_that_of_the_beginning(tmp_path):
    settings = settings_from({**SMALL, "stages": [{"start_weight": 0.25}]})
    evolve(tmp_path, settings)
    first = np.array(_core.Policy(str(tmp_path / "policy.safetensors")).parameters)
    stopped = evolve(tmp_path, settings, index=1, stops_after=1)
    write_policy(stopped.policy(), tmp_path / "policy.safetensors")  # as if it was the best so far
    resumed = Evolution(ID, settings, tmp_path, index=1)
    resumed.resume()
    parameters = _core.Policy.from_bytes("resumed", to_bytes(resumed.policy())).parameters
    assert not np.allclose(first, resumed._optimiser.mean)
    assert np.allclose(parameters, 0.25 * first + 0.75 * resumed._optimiser.mean)


def test_starts_from_the_policy_of_another_environment(tmp_path):
    settings = settings_from({**SMALL, "layers": None, "start": ID, "steps": 1})
    training = Evolution("Hopper-v4", settings, tmp_path)
    assert training.policy().env_id == "Hopper-v4"
    assert training.policy().notes["algorithm"] == "es"


# ---------------------------------------------------------------- the optimiser


@pytest.mark.parametrize(
    "changes", [{}, {"common_seeds": False}, {"max_difference": 0.5}], ids=["", "own", "limited"]
)
def test_strategy_climbs_a_hill(changes):
    settings = settings_from({**SMALL, "population": 40, **changes})
    strategy = AdamStrategy(settings, np.zeros(6))
    top = np.linspace(-1, 1, 6)
    for update in range(150):
        candidates = strategy.ask(np.random.default_rng(update), update / 150)
        assert len(candidates) == 40
        for one, other in zip(candidates[::2], candidates[1::2]):
            assert np.allclose(one + other, 2 * strategy.mean)
        strategy.tell(np.array([-np.sum((each - top) ** 2) for each in candidates]), update / 150)
    assert np.abs(strategy.mean - top).max() < 0.1


def test_first_update_follows_the_formula():
    settings = settings_from({**SMALL, "population": 4, "sigma": [0.5, 0.5]})
    strategy = AdamStrategy(settings, np.array([1.0, 2.0]))
    candidates = strategy.ask(np.random.default_rng(3), 0.0)
    noise = (np.array(candidates[::2]) - [1, 2]) / 0.5
    strategy.tell(np.array([4.0, 1.0, 2.0, 3.0]), 0.0)
    # The ranks from -1/2 to 1/2 are 1/2, -1/2, -1/6, 1/6.
    gradient = (1.0 * noise[0] - 1 / 3 * noise[1]) / (4 * 0.5)
    # Adam's first step has the length of the learning rate in each coordinate.
    step = 0.05 * gradient / (np.abs(gradient) + 1e-8)
    assert np.allclose(strategy.mean, np.array([1, 2]) + step, rtol=1e-9)


def test_a_network_is_worth_less_by_the_deviation_of_its_episodes(tmp_path, monkeypatch):
    def worth(**changes):
        training = Evolution(ID, settings_from({**SMALL, **changes}), tmp_path)
        told = []
        monkeypatch.setattr(training._optimiser, "tell", lambda worth, progress: told.append(worth))
        training.update()
        return told[0]

    one, mean = worth(), worth(episodes=2)
    deviation = np.abs(one - mean)  # of two episodes, whose first is the one
    assert deviation.max() > 0
    careful = worth(episodes=2, deviation_weight=0.5)
    assert np.allclose(careful, mean - 0.5 * deviation, rtol=1e-12)
