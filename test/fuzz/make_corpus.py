#!/usr/bin/env python3
"""Makes the corpora that fuzzing starts from: real inputs, small.

usage: ./scripts/env python3 test/fuzz/make_corpus.py

Overwrites test/fuzz/corpus/NAME/seed_*; what fuzzing has found lies beside them and stays.
"""

import io
import pathlib
import struct
import tempfile

import genpy
import gymnasium
import numpy as np
import rosbag
import walker_sim  # noqa: F401  (registers the environments)
import walker_sim.msg as messages
import walker_sim.srv as services
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState, LaserScan
from std_msgs.msg import Float64MultiArray
from walker_sim.training.policy_file import PolicyFile, to_bytes

ROOT = pathlib.Path(__file__).resolve().parent
REPOSITORY = ROOT.parent.parent


def write(target, name, data):
    folder = ROOT / "corpus" / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"seed_{name}").write_bytes(data)


def serialized(message):
    stream = io.BytesIO()
    message.serialize(stream)
    return stream.getvalue()


def piece(data):
    return struct.pack("<H", len(data)) + data


def bag_of(compression, *all_messages):
    topics = {"Transition": "transition", "EpisodeRecord": "episode_record"}
    with tempfile.NamedTemporaryFile(suffix=".bag") as file:
        with rosbag.Bag(file.name, "w", compression=compression) as bag:
            for stamp, message in enumerate(all_messages):
                topic = "/" + topics[type(message).__name__]
                bag.write(topic, message, genpy.Time(1, stamp))
        return pathlib.Path(file.name).read_bytes()


def answer(message):
    """Returns the TCPROS frame of a successful response."""
    body = serialized(message)
    return b"\x01" + struct.pack("<I", len(body)) + body


def header(**fields):
    body = b"".join(
        struct.pack("<I", len(field)) + field
        for field in (f"{name}={value}".encode() for name, value in fields.items())
    )
    return struct.pack("<I", len(body)) + body


def specification(environment_id="Toy-v0", observations=4, actions=2, num_envs=3):
    return messages.EnvironmentSpec(
        interface_version=1,
        id=environment_id,
        num_envs=num_envs,
        parameter_names=["max_episode_steps"],
        parameter_values=["1000"],
        world=messages.World(parameters=[messages.WorldParameter("gravity", -12.0, -8.0, True)]),
        observation_size=observations,
        observation_dtype="float32",
        observation_low=[-1.0] * observations,
        observation_high=[1.0] * observations,
        action_size=actions,
        action_low=[-1.0] * actions,
        action_high=[1.0] * actions,
        dt=0.02,
        max_episode_steps=1000,
        joint_names=[f"joint_{i}" for i in range(actions)],
        info_names=["x_position"],
        mode="lockstep",
        autoreset_mode="next_step",
        engine="MuJoCo",
        engine_version="2.2.2",
    )


def transition(step=1, actions=2):
    message = messages.Transition(
        environment=0,
        episode=1,
        step=step,
        action=[0.5] * actions if step else [],
        observation=[0.25] * 4,
        reward=1.0,
        episode_return=float(step),
        info=[0.125],
    )
    message.header.stamp = genpy.Time(0, 20)
    message.header.frame_id = "odom"
    return message


def drawn(environment):
    """What an episode has drawn."""
    values = {"friction_scale": 0.5, "gravity": -9.0}
    parameters = [
        messages.WorldParameter(name, value, value, False) for name, value in values.items()
    ]
    return messages.EnvironmentWorld(environment, parameters)


def service_responses():
    batch = services.StepBatchResponse(
        success=True,
        observations=[0.5] * 12,
        rewards=[1.0] * 3,
        terminated=[False, True, False],
        truncated=[False] * 3,
        episodes=[1, 2, 1],
        steps=[3, 0, 3],
        info=[0.0] * 3,
        final_environments=[1],
        final_observations=[0.5] * 4,
        final_info=[0.0],
        worlds=[drawn(1)],
    )
    picture = services.RenderResponse(success=True)
    picture.image.height, picture.image.width = 1, 2
    picture.image.encoding, picture.image.step, picture.image.data = "rgb8", 6, bytes(range(6))
    depth = services.RenderResponse(success=True)
    depth.image.height, depth.image.width = 1, 2
    depth.image.encoding, depth.image.step, depth.image.data = "32FC1", 8, bytes(8)
    return {
        "step": services.StepResponse(success=True, transition=transition(1, actions=4)),
        "step_many": services.StepManyResponse(
            success=True, transition=transition(2, actions=4), steps=2, total_reward=3.0
        ),
        "step_batch": batch,
        "reset_batch": services.ResetBatchResponse(
            success=True, observations=[0.5] * 12, info=[0.0] * 3, worlds=[drawn(0), drawn(2)]
        ),
        "set_world": services.SetWorldResponse(success=True),
        "set_state": services.SetStateResponse(success=True, transition=transition(2, actions=4)),
        "snapshot": services.SnapshotResponse(success=True, record=record()),
        "render": picture,
        "depth": depth,
    }


def record():
    message = messages.EpisodeRecord(spec=specification("BipedalWalker-v3", 24, 4, 1))
    message.spec.engine, message.spec.engine_version = "Box2D", "2.3.0"
    message.spec.parameter_names = ["reuse_world", "max_episode_steps"]
    message.spec.parameter_values = ["false", "1600"]
    message.episode = messages.Episode(episode=1, has_seed=True, seed=7, length=2)
    state = np.random.PCG64(7).state["state"]
    words = [*divmod(state["state"], 1 << 64), *divmod(state["inc"], 1 << 64)]
    message.episode.generator_state = [*words, 0, 0]
    message.episode.world = drawn(0).parameters
    message.actions = [0.5] * 8
    message.pushes = [messages.Push(step=1, link=2, force_x=10.0, torque_y=-1.0)]
    message.checksums = [1, 2, 3]
    return message


def make_client():
    responses = service_responses()
    plain = piece(header(callerid="/walker_sim"))
    spec = specification("Toy-v0", 4, 4, 3)
    start = plain + piece(answer(services.GetSpecResponse(spec=spec)))
    reset = services.ResetResponse(success=True, transition=transition(0, actions=4))
    reset.world = drawn(0).parameters
    calls = plain + piece(answer(reset)) + plain + piece(answer(responses["step"]))
    refused = services.StepResponse(success=False, status_message="there is no episode")
    calls += piece(answer(refused))
    for name in ("step_many", "snapshot", "set_world", "set_state"):
        calls += plain + piece(answer(responses[name]))
    for name in ("reset_batch", "step_batch", "render"):
        calls += plain + piece(answer(responses[name]))
    calls += piece(answer(responses["depth"]))
    write("client", "every_call", start + calls)
    write("client", "error", piece(header(error="it is not there")))
    write("client", "no_spec", start[: len(start) // 2])


def make_master():
    value = (
        "<value><array><data><value><int>{}</int></value><value><string>{}</string></value>"
        "<value>{}</value></data></array></value>"
    )
    response = "<?xml version='1.0'?>\n<methodResponse>{}</methodResponse>\n"
    params = "<params><param>{}</param></params>"
    uri = "rosrpc://localhost:4000"
    found = response.format(params.format(value.format(1, "rosrpc URI: [" + uri + "]", uri)))
    lost = response.format(params.format(value.format(-1, "no provider", "")))
    fault = response.format(
        "<fault><value><struct><member><name>faultCode</name><value><int>1</int></value></member>"
        "<member><name>faultString</name><value><string>a &lt;b&gt;</string></value></member>"
        "</struct></value></fault>"
    )
    kinds = response.format(
        params.format(
            "<value><array><data><value><boolean>1</boolean></value><value><double>0.5</double>"
            "</value><value><i4>-4</i4></value><value><string/></value>"
            "<value><array><data/></array></value></data></array></value>"
        )
    )
    head = "HTTP/1.1 200 OK\r\nContent-Type: text/xml\r\n"
    for name, text in (("length", found), ("lost", lost), ("fault", fault), ("kinds", kinds)):
        write("http", name, f"{head}Content-Length: {len(text)}\r\n\r\n{text}".encode())
    write("http", "closed", f"{head}\r\n{found}".encode())
    write("http", "status", b"HTTP/1.0 404 Not Found\r\n\r\n")


def make_core():
    write("parameter_text", "bipedal_walker", b"\x00max_episode_steps=1600\nreuse_world=true")
    write(
        "parameter_text",
        "walker2d",
        b"\x06frame_skip=4\nhealthy_z_range=[0.8, 2.0]\nreset_noise_scale=5e-3\nxml_file=a.xml",
    )
    write("parameter_text", "camera", b"\x07width=480\nheight=-1\ndistance=.inf")
    ids = ("BipedalWalker-v3", "Walker2d-v5", "BipedalWalkerHardcore-v3", "Hopper-v4")
    cases = [(which, name, None) for which, name in enumerate(ids)] + [(3, ids[3], "laggy")]
    for which, environment_id, world in cases:
        environment = gymnasium.make("walker_sim/" + environment_id, world=world).unwrapped
        environment.reset(seed=3)
        for _ in range(20):
            environment.step(np.zeros(environment.action_space.shape, np.float32))
        state = environment.get_state()
        write("saved_state", world or environment_id, bytes([which]) + bytes(state))
        environment.close()
        if environment_id == "Walker2d-v5":
            write("saved_state", "as_it_is", bytes([0x80 | which]) + bytes(state))
    for name in ("walker2d_v5", "hopper_v5"):
        write("model", name, (REPOSITORY / "assets" / f"{name}.xml").read_bytes())


def make_policy():
    layers = [
        (np.array([[1, 2], [3, 4]]), np.array([0.1, -0.2])),
        (np.array([[0.5, -0.25]]), np.array([0.05])),
    ]
    numbers = [np.array(row) for row in ([1, -1], [2, 0.5], [-1], [1])]  # statistics, limits
    for activation, output in (("tanh", "clip"), ("relu", "tanh")):
        policy = PolicyFile("Toy-v0", {}, activation, output, *numbers, layers)
        write("policy", activation, to_bytes(policy))


def make_server():
    requests = [
        services.StepRequest(action=[0.5] * 4),
        services.StepBatchRequest(actions=[0.5] * 8),
        services.StepManyRequest(action=[0.5] * 4, steps=3),
        services.ResetRequest(has_seed=True, seed=5, world=messages.World("moon", [])),
        services.ResetBatchRequest(
            environments=[0, 1],
            has_seed=[True, False],
            seeds=[5, 0],
            worlds=[messages.World("", drawn(0).parameters), messages.World()],
        ),
        services.RestoreRequest(record=record()),
        services.RenderRequest(environment=0, encoding="rgb8"),
        services.SetRealTimeFactorRequest(),
        Float64MultiArray(data=[0.5] * 4),
        JointState(name=["a", "b"], position=[0.5] * 2, velocity=[0.25] * 2, effort=[80.0] * 2),
        LaserScan(angle_max=1.5, angle_increment=0.17, range_max=9.0, ranges=[1.0] * 10),
        Imu(),
        Odometry(child_frame_id="base_link"),
        messages.Contacts(),
        services.SetWorldRequest(environments=[1], worlds=[messages.World("moon", [])]),
        services.SetStateRequest(environment=1, position=[0.5] * 9, velocity=[0.25] * 9),
    ]
    for kind, request in enumerate(requests):
        kind += kind > 8  # where set_physics_properties' is
        write("requests", type(request).__name__, bytes([kind]) + serialized(request))
    physics = struct.pack("<5dB2I2d4dI", *[0.5] * 5, 0, 0, 50, *[0.5] * 2, *[0.5] * 4, 20)
    write("requests", "SetPhysicsPropertiesRequest", b"\x09" + physics)
    step = serialized(requests[0])
    call = struct.pack("<I", len(step)) + step
    hello = header(callerid="/me", service="/walker_sim/step", md5sum="0123", persistent="1")
    write("service_session", "calls", piece(hello) + 2 * piece(call))
    write("service_session", "at_once", piece(hello + 3 * call))
    write("service_session", "in_parts", piece(hello[:30]) + piece(hello[30:]) + piece(call[:9]))
    write(
        "service_session",
        "once",
        piece(header(callerid="/me", service="/walker_sim/render", md5sum="*")) + piece(call),
    )
    write("service_session", "unknown", piece(header(callerid="/me", service="/x", md5sum="*")))
    write("episode_record", "bipedal_walker", serialized(record()))

    for compression in ("none", "bz2", "lz4"):
        write("bag", compression, bag_of(compression, transition(), record(), record()))


if __name__ == "__main__":
    for make in (make_client, make_master, make_core, make_policy, make_server):
        make()
