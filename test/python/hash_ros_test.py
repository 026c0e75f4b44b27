"""The hash of the reference run over ROS is the documented one, with and without subscribers."""

import os
import pathlib
import sys
import threading
import xmlrpc.client

import pytest
from reference_hashes import HASHES, STEPS
from walker_sim.commands import main
from walkers import IDS

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "server"))


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
def test_the_hash_is_the_documented_one(capsys, serve, environment_id, num_envs, listens):
    name, _ = serve(environment_id, num_envs=num_envs)
    topics, counts = listen(name, name.rpartition("/")[0]) if listens else ({}, {})
    options = ["--transport", "ros", "--server", name, "--num-envs", str(num_envs)]
    assert main(["hash", environment_id, "--steps", str(STEPS), *options]) == 0
    found = capsys.readouterr().out.splitlines()[1].split()[0]
    assert found == HASHES[STEPS][environment_id]
    assert set(counts) == set(topics)
