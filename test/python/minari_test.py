"""record --minari: Minari's own library reads the episodes, and they repeat to the bit."""

import warnings

import minari
import numpy as np
import pytest
from gymnasium_reference import equal_bits

SEEDS = [3, 2**64 - 1, 0]
OF_V4 = {"x_position", "x_velocity"}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    return tmp_path / "datasets"


@pytest.fixture
def record_dataset(command):
    """Records a data set without any warning, and returns what Minari loads."""

    def run(dataset_id, *arguments):
        seeds = ",".join(map(str, SEEDS))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            command("record", *arguments, "--seeds", seeds, "--minari", dataset_id)
        return minari.load_dataset(dataset_id)

    return run


def repeat(environment, seed, options, actions):
    """Returns an episode's observations, rewards, terminations, truncations and infos."""
    observation, info = environment.reset(seed=seed, options=options)
    observations, outcomes, infos = [observation], [], [info]
    for action in actions:
        observation, *outcome, info = environment.step(action)
        observations.append(observation)
        outcomes.append(outcome)
        infos.append(info)
    return (np.array(observations), *map(np.array, zip(*outcomes)), infos)


@pytest.mark.parametrize(
    ("arguments", "size", "names"),
    [
        (["BipedalWalker-v3"], 24, set()),
        (["BipedalWalker-v3", "--world", "hard", "--policy", "random"], 24, set()),
        (
            ["Walker2d-v5", "--world", "{gravity: [-12, -8]}", "ctrl_cost_weight=0.5"],
            17,
            {*OF_V4, "z_distance_from_origin", "reward_forward", "reward_ctrl", "reward_survive"},
        ),
        (["Hopper-v4", "--policy", "shipped", "max_episode_steps=40"], 11, OF_V4),
        (["Hopper-v4", "--policy", "zero", "max_episode_steps=0"], 11, OF_V4),
    ],
)
def test_recovered_environment_repeats_the_episodes(record_dataset, arguments, size, names):
    dataset = record_dataset("walkers/few-v0", *arguments)
    assert dataset.total_episodes == len(SEEDS)
    environment = dataset.recover_environment()
    assert dataset.observation_space == environment.observation_space
    assert dataset.action_space == environment.action_space
    metadata = dataset.storage.get_episode_metadata(range(len(SEEDS)))
    steps = 0
    for seed, given, episode in zip(SEEDS, metadata, dataset.iterate_episodes()):
        assert given["seed"] == seed
        options = given.get("options")
        outcome = repeat(environment, seed, options, episode.actions)
        observations, rewards, terminated, truncated, infos = outcome
        assert episode.observations.shape == (len(episode) + 1, size)
        assert episode.observations.dtype == environment.observation_space.dtype
        assert episode.actions.dtype == np.float32
        assert equal_bits(episode.observations, observations)
        if options:  # the environment's own world draws the same from the seed
            drawn = repeat(environment, seed, None, episode.actions)
            assert equal_bits(episode.observations, drawn[0])
        assert equal_bits(episode.rewards, rewards)
        assert (episode.terminations == terminated).all()
        assert (episode.truncations == truncated).all()
        assert not (episode.terminations | episode.truncations)[:-1].any()
        assert (episode.terminations | episode.truncations)[-1]
        assert set(episode.infos) == names
        for name in names:
            assert equal_bits(episode.infos[name], [info.get(name, np.nan) for info in infos])
        steps += len(episode)
    assert dataset.total_steps == steps
    environment.close()


def test_dataset_equals_the_file_and_describes_its_origin(record_dataset, record, folder):
    arguments = ["Walker2d-v5", "--world", "slippery", "--policy", "random"]
    dataset = record_dataset("random-v3", *arguments)
    recorded, _ = record(*arguments, "--seeds", ",".join(map(str, SEEDS)))
    episodes = [*dataset.iterate_episodes()]
    keys = {"terminations": "terminated", "truncations": "truncated"}
    for name in ("observations", "actions", "rewards", *keys):
        found = np.concatenate([getattr(episode, name) for episode in episodes])
        expected = recorded[keys.get(name, name)]
        assert found.dtype == expected.dtype
        assert equal_bits(found, expected)
    assert dataset.id == "random-v3"
    assert dataset.env_spec.id == "walker_sim/Walker2d-v5"
    assert dataset.spec.data_path == str(folder / "random-v3" / "data")
    metadata = dataset.storage.metadata
    for key in ("policy", "transport", "engine", "engine_version", "walker_sim_version"):
        assert metadata[key] == str(recorded[key])
    assert metadata["numpy_version"] == np.__version__
    assert metadata["algorithm_name"] == "random"
    assert metadata["world"] == "{friction_scale: [0.1, 0.4]}"
    assert metadata["parameters"]["ctrl_cost_weight"] == "0.001"
    assert "3 episodes of Walker2d-v5 with policy random" in metadata["description"]
    worlds = [each["options"]["world"] for each in dataset.storage.get_episode_metadata(range(3))]
    assert worlds == recorded["worlds"].tolist()
    assert len({*worlds}) == len(SEEDS)


def test_the_same_data_set_over_ros(command, serve):
    server, _ = serve("BipedalWalker-v3", num_envs=2)
    arguments = ["BipedalWalker-v3", "--seeds", "5,1", "--policy", "random"]
    command("record", *arguments, "--minari", "in-process-v0")
    command(
        *("record", *arguments, "--minari", "over-ros-v0"),
        *("--transport", "ros", "--server", server, "--num-envs", 2),
    )
    ones, others = map(minari.load_dataset, ("in-process-v0", "over-ros-v0"))
    assert others.storage.metadata["transport"] == "ros"
    assert ones.env_spec == others.env_spec
    for one, other in zip(ones.iterate_episodes(), others.iterate_episodes()):
        for name in ("observations", "actions", "rewards"):
            assert equal_bits(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        *(
            (
                ["--minari", name],
                f"--minari {name}: must be NAME-vN, with or without FOLDER/ before",
            )
            for name in ("", "walk", "walk-v", "/walk-v0", "a//b-v0", "../walk-v0", "a/x-v0")
        ),
        (["--minari", "walk-v0", "hard=1"], "hard"),
        (["--minari", "walk-v0", "--world", "{gravity: 3}"], "gravity"),
        (["--minari", "walk-v0", "xml_file=/no/such.xml"], "/no/such.xml"),
    ],
)
def test_error_names_invalid_id_or_walker(command, folder, words, message):
    assert message in command("record", "Walker2d-v5", *words, status=2).err
    assert not [*folder.glob("*")]


@pytest.mark.parametrize("earlier", [[], ["hop/first-v0"]])
def test_a_data_set_is_whole_and_written_once(command, folder, full_disk, earlier):
    """On a full disk HDF5 would print a hundred lines to standard error and end this process."""
    arguments = ["record", "Hopper-v5", "--policy", "zero", "--episodes", 1, "--minari"]
    for dataset_id in earlier:
        command(*arguments, dataset_id)
    before = {*folder.rglob("*")}
    with full_disk(8000):
        error = command(*arguments, "hop/zero-v0", status=2).err
    assert f"File too large: '{folder}/hop/zero-v0/data/main_data.hdf5'" in error
    assert {*folder.rglob("*")} == before
    command(*arguments, "hop/zero-v0")
    assert minari.load_dataset("hop/zero-v0").storage.metadata["dataset_size"] > 0
    written = (folder / "hop/zero-v0/data/main_data.hdf5").read_bytes()
    error = command(*arguments, "hop/zero-v0", status=2).err
    assert "--minari hop/zero-v0: " in error
    assert "exists; `minari delete` removes it" in error
    assert (folder / "hop/zero-v0/data/main_data.hdf5").read_bytes() == written
