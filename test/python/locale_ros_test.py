"""A program that sets a locale, as Qt and GTK do, gets the same bits over ROS."""

import locale
import pathlib
import pickle
import subprocess

import pytest
from walkers import follow, make_ours, random_actions

ID = "Walker2d-v5"
PARAMETERS = {"reset_noise_scale": 0.001, "forward_reward_weight": 1.5}
MODEL = pathlib.Path(__file__).parents[2] / "assets" / "walker2d_v5.xml"


@pytest.fixture
def german(tmp_path, monkeypatch):
    """Compiles a locale with a decimal comma. Returns a function that sets it."""
    subprocess.run(
        ["localedef", "-i", "de_DE", "-f", "UTF-8", str(tmp_path / "de_DE.UTF-8")], check=True
    )
    monkeypatch.setenv("LOCPATH", str(tmp_path))
    before = locale.setlocale(locale.LC_ALL)

    def set_it():
        locale.setlocale(locale.LC_ALL, "de_DE.UTF-8")
        assert locale.format_string("%.1f", 0.5) == "0,5"

    yield set_it
    monkeypatch.delenv("LOCPATH")
    locale.setlocale(locale.LC_ALL, before)


def test_an_episode_and_its_states(serve, german):
    server, _ = serve(ID, **PARAMETERS)
    local = make_ours(ID, **PARAMETERS)
    actions = random_actions(ID, 40)
    local.reset(seed=5)
    begun = follow(local, actions[:10])
    state = local.unwrapped.get_state()
    ended = follow(local, actions[10:])

    german()
    remote = make_ours(ID, transport="ros", server=server, **PARAMETERS)
    remote.reset(seed=5)
    assert follow(remote, actions[:10]) == begun
    record = remote.unwrapped.get_state()
    assert follow(remote, actions[10:]) == ended
    remote.unwrapped.set_state(pickle.loads(pickle.dumps(record)))
    assert follow(remote, actions[10:]) == ended

    anew = make_ours(ID, **PARAMETERS)
    anew.reset(seed=1)
    anew.unwrapped.set_state(state)
    assert anew.unwrapped.get_state() == state
    assert follow(anew, actions[10:]) == ended


def test_a_custom_model(german):
    actions = random_actions(ID, 40)

    def episode():
        environment = make_ours(ID, xml_file=str(MODEL))
        observation, _ = environment.reset(seed=5)
        return [observation.tobytes(), *follow(environment, actions)]

    before = episode()
    german()
    assert episode() == before
