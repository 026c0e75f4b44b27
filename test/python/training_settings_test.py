"""Settings of a training: checks of their values, their files and their stages."""

import pathlib
import re

import pytest
from walker_sim import _core
from walker_sim.training.settings import Settings, SettingsError, settings_from
from walker_sim.training.settings_file import read_settings, write_settings

ROOT = pathlib.Path(__file__).parents[2]
ID = "Hopper-v5"


def test_shipped_settings_survive_writing(tmp_path):
    files = sorted((ROOT / "config/training").glob("*.yaml"))
    plain = [file.stem for file in files if not file.stem.endswith(("-quick", "-robust"))]
    assert plain == sorted(_core.ids())
    hashes = set()
    for file in files:
        settings = read_settings(file)
        write_settings(settings, tmp_path / "again.yaml")
        again = read_settings(tmp_path / "again.yaml")
        assert again == settings
        assert again.hash() == settings.hash()
        hashes.add(settings.hash())
    assert len(hashes) == len(files) - 1  # Hopper-v4's is v5's
    assert settings_from({}) == Settings()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"algorithms": "ppo"}, "algorithms: unknown; must be one of algorithm, steps"),
        ({"algorithm": "dqn"}, "algorithm = 'dqn': must be one of ppo, sac, tqc, es, cma"),
        ({"steps": 0}, "steps = 0: must be a whole number from 1"),
        ({"steps": 1e6}, "steps = 1000000.0: must be a whole number"),
        ({"gamma": 1.5}, "gamma = 1.5: must be a number from 0 to 1"),
        ({"gamma": float("nan")}, "gamma = nan"),
        ({"layers": 64}, "layers = 64: must be a list of 0 to 8 whole numbers"),
        ({"layers": [64, "64"]}, "layers = '64': must be a whole number"),
        ({"learning_rate": 1e-3}, "learning_rate = 0.001: must be two numbers"),
        ({"least_reward": 1}, "least_reward = 1: must be a number from -inf to 0"),
        ({"changes": {10: {"seed": 1}}}, "changes: 'seed': must be one of gamma, least_reward"),
        ({"parameters": 3}, "parameters = 3: must be a mapping"),
        ({"parameters": {"hardcore": None}}, "parameters: hardcore = None: must be true or false,"),
        (
            {"algorithm": "sac", "start": "shipped"},
            "start = 'shipped': algorithm = 'sac': must be one of ppo, es, cma",
        ),
        ({"world": []}, "world = []: must be a world, or a list of worlds"),
        ({"world": ["moon", "sun"]}, "world: 2: world sun, neither a preset nor"),
        ({"world": [{"world": "moon", "wait": 2}]}, "world: 1: wait: unknown; must be one"),
        ({"world": [{"world": "moon", "weight": 0.5}]}, "world: 1: weight = 0.5: must be a whole"),
        ({"world": [{"world": "moon", "weight": 0}]}, "world: weights = [0]: must be more than"),
        ({"world": ["moon", "moon"]}, "world: 2: name = 'moon': must be another than those of the"),
        ({"world": [{"world": "moon", "name": ""}]}, "world: 1: name = '': must be a text"),
        (
            {"world": [{"world": "moon", "name": "steps"}]},
            "world: 1: name = 'steps': must be another",
        ),
        (
            {"history": [4, 3], "stages": [{"algorithm": "es", "history": [4, 2]}]},
            "stages: 1: history = [4, 2]: must be at least [4, 3] as in the stage before",
        ),
        (
            {"world": ["moon", "pushed"], "curriculum": {"thresholds": [1, 2]}},
            "must be null, because world lists 2 worlds",
        ),
        ({"keep_best_by": "most"}, "keep_best_by = 'most': must be one of mean, min"),
        ({"curriculum": 3}, "curriculum = 3: must be a mapping"),
        ({"curriculum": {"moves": 4}}, "must have thresholds: [LOW, HIGH]"),
        ({"curriculum": {"steps": 4}}, "steps: unknown; must be one of thresholds, moves, episod"),
        ({"curriculum": {"thresholds": 4}}, "curriculum: thresholds = 4: must be two numbers"),
        ({"curriculum": {"thresholds": [2, 1]}}, "thresholds = [2.0, 1.0]: must be a lower and an"),
        ({"algorithm": "es", "population": 7}, "population = 7: must be even, for pairs"),
        ({"population": 1}, "population = 1: must be a whole number from 2"),
        ({"sigma": 0.1}, "sigma = 0.1: must be two numbers"),
        ({"sigma": [0, 0.1]}, "sigma = 0: must be a number from 1e-06 to 10"),
        ({"sigma": [0.1, 0.1]}, "sigma = (0.1, 0.1): must be left out, because only es, cma have"),
        ({"algorithm": "es", "entropy": 0.1}, "entropy = 0.1: must be left out, because only ppo"),
        ({"common_seeds": 1}, "common_seeds = 1: must be true or false"),
        ({"start": 3}, "start = 3: must be a text"),
        ({"start_weight": 1.5}, "start_weight = 1.5: must be a number from 0 to 1"),
        (
            {"stages": [{"algorithm": "tqc"}]},
            "stages: 1: algorithm = 'tqc': must be one of ppo, es, cma",
        ),
        (
            {"algorithm": "sac", "stages": [{"algorithm": "ppo"}]},
            "stages: 1: algorithm = 'ppo': must be one of es, cma, because sac's actions are squ",
        ),
        (
            {"stages": [{"algorithm": "es", "activation": "relu"}]},
            "stages: 1: activation = 'relu': must be left out, because the policy of the stage",
        ),
        (
            {"layers": [64], "stages": [{"algorithm": "es", "layers": [32]}]},
            "stages: 1: layers = [32]: must be [64] as in the stage before",
        ),
        ({"stages": [{"seed": 3}]}, "stages: 1: seed: must be the same in all stages"),
        ({"stages": [{"sigmas": 3}]}, "stages: 1: sigmas: unknown; must be one of algorithm"),
        ({"stages": {}}, "stages = {}: must be a list of mappings"),
    ],
)
def test_error_names_invalid_setting(given, words):
    with pytest.raises(SettingsError, match=re.escape(words)):
        settings_from(given)


def test_numbers_with_an_exponent_are_numbers(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text(
        "algorithm: es\nsteps: 2e6\nlearning_rate: [1e-2, 5E-3]\nmax_difference: 1.e+1\n"
        "evaluate_every: .5e3\n"
        "parameters: {healthy_reward: 1e-2, xml_file: '1e4'}\n"
    )
    for _ in range(2):
        settings = read_settings(file)
        assert (settings.steps, settings.learning_rate) == (2_000_000, (0.01, 0.005))
        assert (settings.max_difference, settings.evaluate_every) == (10, 500)
        assert settings.parameters == {"healthy_reward": 0.01, "xml_file": "1e4"}
        write_settings(settings, file)


TOO_SHORT = "world parameter action_delay = 0.001 s: is shorter than half a step"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"seed: 1\nsteps: 5\nseed: 2", "mine.yaml: line 3: seed: must be given once"),
        (b"parameters: {a: 1, b: 2, a: 1}", "mine.yaml: line 1: a: must be given once"),
        (
            b"changes:\n  1000: {gamma: 0.9}\n  1e3: {gamma: 0.8}",
            "line 3: 1000: must be given once",
        ),
        (b"[" * 1000, "nested too deep"),
        (b"parameters: " + b"{a: " * 1000 + b"1" + b"}" * 1000, "nested too deep"),
        (b"steps: 2026-13-01", "month must be in 1..12"),
        (b"algorithm: \xff", "'utf-8' codec can't decode"),
        (b"steps: ]", "expected the node content"),
        (b"parameters: {hardcore: " + b"[" * 50 + b"]" * 50 + b"}", "or a list of numbers"),
        (b"algorithm: es\nworld: {action_delay: 0.001}", TOO_SHORT),
        (
            b"algorithm: es\nworld: {action_delay: [0.001, 0.016]}\n"
            b"curriculum: {thresholds: [1, 2]}",
            TOO_SHORT,
        ),
        (
            b"algorithm: es\nworld: {gravity: [-9, -5]}\ncurriculum: {thresholds: [1, 2]}\n"
            b"stages: [{world: {gravity: -5}}]",
            "curriculum: world = {gravity: -5.0} has no range that grows",
        ),
        (
            b"algorithm: es\nworld: {gravity: {log: [-9, -5]}}\ncurriculum: {thresholds: [1, 2]}",
            "curriculum: world = {gravity: {log: [-9.0, -5.0]}}: must have neither log nor",
        ),
        (
            b"algorithm: es\nworld: {gravity: [-9, -5], change_interval: 1}\n"
            b"curriculum: {thresholds: [1, 2]}",
            "curriculum: world = {change_interval: 1.0}: must have neither log nor",
        ),
    ],
)
def test_error_names_invalid_settings_file(tmp_path, command, content, words):
    file = tmp_path / "mine.yaml"
    file.write_bytes(content)
    error = command("train", ID, "--settings", file, "--out", tmp_path / "run", status=2).err
    assert words in error


def test_stages_change_single_settings():
    stages = [{"layers": [5], "steps": 8_000}, {"steps": 5}]
    given = {"algorithm": "es", "steps": 20_000, "start": "shipped", "stages": stages}
    settings = settings_from(given)
    assert [settings.stage(index).steps for index in range(3)] == [20_000, 8_000, 5]
    assert [settings.steps_before(index) for index in range(3)] == [0, 20_000, 28_000]
    assert settings.stage(2).layers == (5,)
    assert [settings.stage(index).start for index in range(3)] == ["shipped", None, None]
