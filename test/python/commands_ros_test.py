"""The commands print and write the same over ROS as in process."""

import os
import threading
import xmlrpc.client

import pytest
from reference_hashes import HASHES, STEPS
from walkers import IDS

WALKERS = [
    ("BipedalWalker-v3", ["max_episode_steps=300"], {"max_episode_steps": 300}),
    ("Walker2d-v5", ["reset_noise_scale=0.1"], {"reset_noise_scale": 0.1}),
]


@pytest.mark.parametrize("walker", WALKERS)
@pytest.mark.parametrize("num_envs", [1, 3])
def test_evaluation_equals_in_process(command, tmp_path, serve, walker, num_envs):
    env_id, words, parameters = walker
    name, _ = serve(env=env_id, num_envs=num_envs, **parameters)
    words = ["evaluate", env_id, *words, "--policy", "random", "--episodes", 7]
    results = []
    for number, where in enumerate(([], ["--transport", "ros", "--server", name])):
        sizes = ["--num-envs", num_envs] if where else []
        file = tmp_path / f"{number}.csv"
        out = command(*words, *where, *sizes, "--csv", file).out
        results.append((out, file.read_text()))
    assert results[0] == results[1]


def test_evaluation_names_the_servers_world(command, tmp_path, serve):
    world = "{gravity: [-12.0, -8.0], motor_strength: 0.9}"
    name, _ = serve(world=world)
    words = ["evaluate", "BipedalWalker-v3", "--policy", "random", "--episodes", 2]
    results = []
    for where in (["--world", world], ["--transport", "ros", "--server", name]):
        files = [tmp_path / "one.csv", tmp_path / "one.json"]
        out = command(*words, *where, "--csv", files[0], "--json", files[1]).out
        results.append((out, *(file.read_text() for file in files)))
    assert f"world {world}," in results[0][0]
    assert results[0] == results[1]


def test_a_grid_equals_in_process_and_leaves_the_servers_world(command, tmp_path, serve):
    name, _ = serve(world="{gravity: -9}", num_envs=2)
    words = ["evaluate", "BipedalWalker-v3", "--policy", "random", "--episodes", 3]
    ros = ["--transport", "ros", "--server", name, "--num-envs", 2]
    before = command(*words, *ros).out
    compared = [*words, "--grid", "gravity=-20,-5", "--world", "laggy", "noisy", "--worst", 1]
    results = []
    for number, where in enumerate(([], ros)):
        file = tmp_path / f"{number}.json"
        out = command(*compared, *where, "--json", file).out
        results.append((out, file.read_text()))
    assert results[0] == results[1]
    assert command(*words, *ros).out == before


def test_recording_repeats_over_ros_and_in_process(command, tmp_path, serve):
    name, _ = serve(env="BipedalWalkerHardcore-v3", num_envs=2)
    ros = ["--transport", "ros", "--server", name, "--num-envs", 2]
    here, there = tmp_path / "here.npz", tmp_path / "there.npz"
    for file, where in ((here, []), (there, ros)):
        options = ["--seeds", "5:9", "--output", file]
        command("record", "BipedalWalkerHardcore-v3", *options, *where)
    for file, where in ((here, ros), (there, [])):
        out = command("record", "--check", file, *where).out
        assert "4 of 4 episodes equal to the bit" in out


def test_bench_measures_the_server(command, serve):
    name, _ = serve(env="BipedalWalker-v3", num_envs=3)
    options = ["--seconds", 0.2, "--num-envs", 3, "--transport", "ros", "--server", name]
    out = command("bench", "BipedalWalker-v3", *options).out
    assert "\n  walker_sim over ROS, 3 " in out


@pytest.mark.parametrize("name_of_command", ["evaluate", "bench"])
def test_error_names_server_differences(command, serve, name_of_command):
    name, _ = serve(env="BipedalWalker-v3", num_envs=3)
    arguments = ["BipedalWalker-v3", "hardcore=true", "--transport", "ros", "--server", name]
    error = command(name_of_command, *arguments, "--num-envs", 2, status=2).err
    assert error.startswith(f"walker_sim {name_of_command}: the server {name}: ")
    assert "num_envs is 3 there; must be 2" in error
    assert "hardcore is false there; must be true" in error


def listen(name, namespace):
    from bare_ros import CALLER, BareSubscriber
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import JointState
    from tf2_msgs.msg import TFMessage
    from visualization_msgs.msg import MarkerArray
    from walker_sim.msg import Transition

    uri = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"]).lookupNode(CALLER, name)[2]
    topics = {
        f"{namespace}/transition": Transition,
        f"{namespace}/joint_states": JointState,
        f"{namespace}/odom": Odometry,
        f"{namespace}/state_markers": MarkerArray,
        "/tf": TFMessage,
    }
    counts = {}

    def read(topic, subscriber):
        try:
            while True:
                subscriber.next()
                counts[topic] = counts.get(topic, 0) + 1
        except OSError:
            pass

    for topic, message_class in topics.items():
        subscriber = BareSubscriber(uri, topic, message_class)
        threading.Thread(target=read, args=(topic, subscriber), daemon=True).start()
    return topics, counts


@pytest.mark.parametrize("environment_id", IDS)
@pytest.mark.parametrize(("num_envs", "listens"), [(1, False), (1, True), (7, True)])
def test_hash_is_the_documented_one(command, serve, environment_id, num_envs, listens):
    name, _ = serve(environment_id, num_envs=num_envs)
    topics, counts = listen(name, name.rpartition("/")[0]) if listens else ({}, {})
    options = ["--transport", "ros", "--server", name, "--num-envs", num_envs]
    lines = command("hash", environment_id, "--steps", STEPS, *options).out.splitlines()
    assert lines[1].split()[0] == HASHES[STEPS][environment_id]
    assert set(counts) == set(topics)
