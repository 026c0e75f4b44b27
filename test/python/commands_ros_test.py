"""The commands print and write the same over ROS as in process."""

import contextlib
import os
import threading
import xmlrpc.client

import pytest
from reference_hashes import HASHES, STEPS
from walkers import IDS

WORLD = "{gravity: [-12.0, -8.0], motor_strength: 0.9}"


def ros(server, num_envs=1):
    return ["--transport", "ros", "--server", server, "--num-envs", num_envs]


@pytest.fixture
def outputs(command, tmp_path):
    """Runs `evaluate` with a random policy. Returns what it prints and writes."""

    def run(*words):
        files = [tmp_path / "one.csv", tmp_path / "one.json"]
        words = [*words, "--policy", "random", "--csv", files[0], "--json", files[1]]
        return [command("evaluate", *words).out, *(file.read_text() for file in files)]

    return run


@pytest.mark.parametrize(
    ("env_id", "name", "value"),
    [
        ("BipedalWalker-v3", "max_episode_steps", 300),
        ("Walker2d-v5", "reset_noise_scale", 0.1),
        ("BipedalWalker-v3", "world", WORLD),
    ],
)
@pytest.mark.parametrize("num_envs", [1, 3])
def test_evaluation_equals_in_process(outputs, serve, env_id, name, value, num_envs):
    server, _ = serve(env=env_id, num_envs=num_envs, **{name: value})
    words = [env_id, "--episodes", 7]
    given = ["--world", value] if name == "world" else [f"{name}={value}"]
    there = [] if name == "world" else given  # the server's own world is not asked for
    here = outputs(*words, *given)
    assert here == outputs(*words, *there, *ros(server, num_envs))
    assert name != "world" or f"world {WORLD}," in here[0]


def test_a_grid_equals_in_process_and_leaves_the_servers_world(outputs, serve):
    name, _ = serve(world="{gravity: -9}", num_envs=2)
    words = ["BipedalWalker-v3", "--episodes", 3]
    before = outputs(*words, *ros(name, 2))
    compared = [*words, "--grid", "gravity=-20,-5", "--world", "laggy", "noisy", "--worst", 1]
    assert outputs(*compared) == outputs(*compared, *ros(name, 2))
    assert outputs(*words, *ros(name, 2)) == before


def test_recording_repeats_over_ros_and_in_process(command, tmp_path, serve):
    name, _ = serve(env="BipedalWalkerHardcore-v3", num_envs=2)
    here, there = tmp_path / "here.npz", tmp_path / "there.npz"
    for file, where in ((here, []), (there, ros(name, 2))):
        options = ["--seeds", "5:9", "--output", file]
        command("record", "BipedalWalkerHardcore-v3", *options, *where)
    for file, where in ((here, ros(name, 2)), (there, [])):
        out = command("record", "--check", file, *where).out
        assert "4 of 4 episodes equal to the bit" in out


def test_bench_measures_the_server(command, serve):
    name, _ = serve(env="BipedalWalker-v3", num_envs=3)
    out = command("bench", "BipedalWalker-v3", "--seconds", 0.2, *ros(name, 3)).out
    assert "\n  walker_sim over ROS, 3 " in out


@pytest.mark.parametrize("name_of_command", ["evaluate", "bench"])
def test_error_names_server_differences(command, serve, name_of_command):
    name, _ = serve(env="BipedalWalker-v3", num_envs=3)
    words = ["BipedalWalker-v3", "hardcore=true", *ros(name, 2)]
    error = command(name_of_command, *words, status=2).err
    assert error.startswith(f"walker_sim {name_of_command}: the server {name}: ")
    assert "num_envs is 3 there; must be 2" in error
    assert "hardcore is false there; must be true" in error


def listen(name):
    """Subscribes to topics of states. Returns them, and those of which a message has come."""
    from bare_ros import CALLER, BareSubscriber
    from rospy import AnyMsg

    uri = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"]).lookupNode(CALLER, name)[2]
    namespace, heard = name.rpartition("/")[0], set()

    def read(topic, subscriber):
        with contextlib.suppress(OSError):
            while subscriber.next():
                heard.add(topic)

    names = ("transition", "joint_states", "odom", "state_markers")
    topics = {"/tf", *(f"{namespace}/{topic}" for topic in names)}
    for topic in topics:
        arguments = (topic, BareSubscriber(uri, topic, AnyMsg))
        threading.Thread(target=read, args=arguments, daemon=True).start()
    return topics, heard


@pytest.mark.parametrize("environment_id", IDS)
@pytest.mark.parametrize(("num_envs", "listens"), [(1, False), (1, True), (7, True)])
def test_hash_is_the_documented_one(command, serve, environment_id, num_envs, listens):
    name, _ = serve(environment_id, num_envs=num_envs)
    topics, heard = listen(name) if listens else (set(), set())
    words = ["hash", environment_id, "--steps", STEPS, *ros(name, num_envs)]
    assert command(*words).out.splitlines()[1].split()[0] == HASHES[STEPS][environment_id]
    assert heard == topics
