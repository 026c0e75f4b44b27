"""Worlds of walker_sim.sb3.VecEnv and of training."""

import re

import gymnasium
import pytest
from stable_baselines3.common.env_util import make_vec_env
from walker_sim import _core
from walker_sim.sb3 import VecEnv
from walker_sim.training.settings import SettingsError, settings_from
from walker_sim.training.settings_file import read_settings, write_settings


def test_make_vec_env_passes_the_world():
    world = {"gravity": (-9, -8), "push_interval": 1}
    envs = make_vec_env("walker_sim/Hopper-v5", 3, vec_env_cls=VecEnv, env_kwargs={"world": world})
    assert envs.get_attr("world") == [{"gravity": (-9.0, -8.0), "push_interval": (1.0, 1.0)}] * 3
    envs.reset()
    assert all(-9 <= info["world"]["gravity"] <= -8 for info in envs.reset_infos)
    worlds = ["moon", None]
    makers = [lambda w=world: gymnasium.make("walker_sim/Hopper-v5", world=w) for world in worlds]
    assert VecEnv(makers).get_attr("world") == [{"gravity": (-1.62, -1.62)}, {}]
    with pytest.raises(ValueError, match="world = 'moon': determined by the functions"):
        VecEnv(makers, world="moon")


def test_refused_worlds():
    envs = VecEnv("Hopper-v5", 3, world="moon")
    envs.reset()
    before = envs.get_state()
    with pytest.raises(ValueError, match="2 worlds; must be one, or 3, one for each walker"):
        envs.set_world(["moon"] * 2)
    with pytest.raises(TypeError):  # one world is set for all
        envs.env_method("set_world", ["moon"] * 3)
    envs.set_options([{"world": "pushed"}, {}, {"world": {"wind": 1}}])
    with pytest.raises(ValueError, match="wind"):
        envs.reset()
    assert envs.get_state() == before
    with pytest.raises(AttributeError, match="world: cannot be set by set_attr; call set_world"):
        envs.set_attr("world", None)
    envs.close()
    with pytest.raises(RuntimeError, match="this VecEnv is closed"):
        envs.set_world(None)


# ---------------------------------------------------------------- training


def test_the_world_of_settings(tmp_path):
    expected = {"gravity": (-9.0, -8.0), "push_interval": (2.0, 2.0)}
    file = tmp_path / "mine.yaml"
    file.write_text("gravity: [-9, -8]\npush_interval: 2\n")
    given = [expected, {"gravity": [-9, -8], "push_interval": 2}, str(file)]
    settings = [settings_from({"world": world}) for world in given]
    assert all(one.world == expected for one in settings)
    assert {one.hash() for one in settings} == {settings[0].hash()}
    assert settings[0].hash() != settings_from({}).hash()
    for nothing in (None, "gymnasium", {}):
        assert settings_from({"world": nothing}) == settings_from({})
    assert settings_from({"world": "moon"}).world == {"gravity": (-1.62, -1.62)}
    write_settings(settings[0], tmp_path / "again.yaml")
    assert read_settings(tmp_path / "again.yaml") == settings[0]
    for world, message in (
        ("mon", "world: world mon, neither a preset nor a readable YAML file"),
        ({"gravity": "x"}, "world: world parameter gravity = 'x': must be a number"),
        (5, "world: world = 5: must be None"),
    ):
        with pytest.raises(SettingsError, match=re.escape(message)):
            settings_from({"world": world})


def test_train_and_evaluate_in_a_world(tmp_path, command, evaluate):
    (tmp_path / "small.yaml").write_text(
        "{steps: 1024, num_envs: 4, rollout: 64, batch_size: 64, epochs: 1, evaluate_every: 1024, "
        "evaluation_episodes: 3, world: pushed}\n"
    )
    folder, text = tmp_path / "run", "{gravity: [-9, -8]}"
    given = ["train", "Hopper-v5", "--settings", tmp_path / "small.yaml", "--num-threads", 1]
    command(*given, "--out", tmp_path / "pushed")
    command(*given, "--out", folder, "--world", text)
    assert read_settings(tmp_path / "pushed" / "settings.yaml").world == _core.load_world("pushed")
    assert read_settings(folder / "settings.yaml").world == _core.load_world(text)
    policy = _core.Policy(str(folder / "policy.safetensors"))
    assert policy.notes["world"] == "{gravity: [-9.0, -8.0]}"
    returns = {}
    for world in (text, "gymnasium"):
        words = ["Hopper-v5", "--seeds", "2000000:2000003", "--world", world]
        _, found = evaluate(*words, "--policy", folder / "policy.safetensors")
        returns[world] = found["mean"]
    points = [line.split(",") for line in (folder / "curve.csv").read_text().splitlines()]
    evaluated = max(float(point[3]) for point in points[1:])
    assert returns[text] == pytest.approx(evaluated, rel=1e-5)
    assert returns["gymnasium"] != pytest.approx(evaluated, rel=1e-3)
    command("train", "--resume", folder, "--world", "moon", status=2)


def test_train_refuses_worlds(tmp_path, command, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for world, message in (
        ("mon", "neither a preset nor a readable YAML file: unknown; did you mean moon?"),
        ("{hip_speed: 3}", "cannot be applied by Hopper-v5; BipedalWalker-v3 has it"),
    ):
        assert message in command("train", "Hopper-v5", "--world", world, status=2).err
    (tmp_path / "hard.yaml").write_text("world: hard\n")
    given = ["train", "Hopper-v5", "--settings", "hard.yaml", "--out", "run"]
    assert "must be in [0.02, 1.0] m" in command(*given, status=2).err
