#!/usr/bin/python3
"""Ten common problems of walker simulations on ROS: one test for each.

Each docstring lists what its test catches. Nothing here waits in simulation time.
"""

import itertools
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
import xmlrpc.client

import rosgraph
import rospy
import rostest
import tf2_ros
from bare_ros import CALLER, PATIENCE, BareSubscriber, OwnMaster, wait_for
from launched import Launched
from nav_msgs.msg import Odometry
from recorded_episodes import read_bipedal_walker, read_walker2d
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState, LaserScan
from server_harness import (
    DT,
    Process,
    ServerTest,
    bits,
    first_stamp,
    nanoseconds,
    same_experience,
)
from std_msgs.msg import Float64, Float64MultiArray
from tf2_msgs.msg import TFMessage
from walker_sim.msg import Contacts, Transition
from walker_sim.srv import Reset, Snapshot, Step

SECOND = 10**9  # ns
ACTION_SIZES = {"BipedalWalker-v3": 4, "Walker2d-v5": 6}
STAND = [1.0, 1.0, -1.0, 1.0]  # BipedalWalker stands astride for thousands of steps
SEEDS = (0, 1, 2**31, 2**32 - 1, 2**32, 2**63 - 1, 2**63, 2**64 - 1)
PROMPT = 15  # wall seconds; a clean exit takes less than 1

# A node that starts before there is any simulation time. Its callbacks call the server while
# another thread sleeps in simulation time. It prints which of them have finished.
EARLY_NODE = """
import threading
import rospy
from rosgraph_msgs.msg import Clock
from walker_sim.msg import Transition
from walker_sim.srv import Reset, Step

rospy.init_node("early_node")
assert rospy.get_param("/use_sim_time") and rospy.Time.now().is_zero()
print("early", flush=True)
rospy.wait_for_service("/walker_sim/step")
while rospy.Time.now().is_zero():  # told before the first reset
    threading.Event().wait(0.01)
reset = rospy.ServiceProxy("/walker_sim/reset", Reset)
step = rospy.ServiceProxy("/walker_sim/step", Step)
finished = {name: threading.Event() for name in ("transition", "clock", "sleep")}

def sleep():
    rospy.sleep(0.4)
    finished["sleep"].set()

def on_transition(message):
    if message.step < 50:
        assert step([1.0, 1.0, -1.0, 1.0]).success
    else:
        finished["transition"].set()

def on_clock(message):
    if not finished["clock"].is_set():
        assert step([1.0, 1.0, -1.0, 1.0]).success
    if finished["transition"].is_set():
        finished["clock"].set()

threading.Thread(target=sleep, daemon=True).start()
transitions = rospy.Subscriber("/transition", Transition, on_transition)
while transitions.get_num_connections() == 0:
    threading.Event().wait(0.01)
assert reset(True, 1).success
clock = rospy.Subscriber("/clock", Clock, on_clock)
for name, event in finished.items():
    print(name, "finished" if event.wait(30) else "hangs", flush=True)
"""


def registrations(node):
    """Topics and services of a node that are registered at the master."""
    kinds = rosgraph.Master(CALLER).getSystemState()
    return [name for kind in kinds for name, nodes in kind if node in nodes]


def zeros(env):
    return [0.0] * ACTION_SIZES[env]


def newest_transform(buffer):
    try:
        return buffer.get_latest_common_time("odom", "hull").to_nsec()
    except tf2_ros.TransformException:
        return 0


def swaying(env, count):
    """Varied actions in [-1, 1] that float32 represents exactly."""
    width = ACTION_SIZES[env]
    return [[((7 * i + 5 * j) % 17 - 8) / 8 for j in range(width)] for i in range(count)]


class TenPainsTest(ServerTest):
    def serve(self, name="/walker_sim", master_uri=None, **parameters):
        """Adds `reset` and `step`, persistent clients, to the server."""
        server = super().serve(name, master_uri, **parameters)
        for service, kind in (("reset", Reset), ("step", Step)):
            client = server.client(service, kind)
            self.addCleanup(client.close)
            setattr(server, service, lambda c=client, **fields: self.succeed(c(**fields)))
        return server

    def succeed(self, reply):
        self.assertTrue(reply.success, reply.status_message)
        return reply.transition

    def lockstep(self, env="BipedalWalker-v3", name="/walker_sim", **parameters):
        return self.serve(name, env=env, mode="lockstep", **parameters)

    @staticmethod
    def play(server, seed, actions):
        """Returns the transitions of an episode, the reset's first."""
        begun = server.reset(has_seed=True, seed=seed)
        return [begun, *(server.step(action=action) for action in actions)]

    def assert_same(self, one, other):
        self.assertEqual(len(one), len(other))
        for i, pair in enumerate(zip(one, other)):
            self.assertTrue(same_experience(*pair), f"step {i} differs")

    def subscribe(self, server, topic, kind):
        """Opens a connection whose messages arrive in order; no client-side queue drops any."""
        uri = rosgraph.Master(CALLER).lookupNode(server.name)
        subscriber = BareSubscriber(uri, topic, kind)
        self.addCleanup(subscriber.close)
        return subscriber

    def assert_grows(self, stamps):
        for one, other in zip(stamps, stamps[1:]):
            self.assertLess(one, other)

    def test_01_a_step_returns_when_it_is_done(self):
        """Catches replies before the state has advanced, steps that are lost or duplicated under
        concurrent calls, and a simulation that advances after the reply."""
        server = self.lockstep(max_episode_steps=0)
        told = self.subscribe(server, "/transition", Transition)
        snapshot = server.client("snapshot", Snapshot)
        self.addCleanup(snapshot.close)
        last = server.reset(has_seed=True, seed=1)
        for number in range(1, 101):
            reply = server.step(action=STAND)
            self.assertEqual((reply.step, nanoseconds(reply)), (number, nanoseconds(last) + DT))
            episode = snapshot().record.episode
            self.assertEqual((episode.length, nanoseconds(episode)), (number, nanoseconds(reply)))
            last = reply

        replies = {number: [] for number in range(2)}
        clients = [server.client("step", Step) for _ in replies]

        def call(number):
            for _ in range(200):
                replies[number].append(clients[number](action=STAND).transition)

        threads = [threading.Thread(target=call, args=(number,)) for number in replies]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(PATIENCE)
        for client in clients:
            client.close()
        counted = [[reply.step for reply in replies[number]] for number in replies]
        for steps in counted:
            self.assert_grows(steps)
        self.assertEqual(sorted(itertools.chain(*counted)), list(range(101, 501)))
        self.assertEqual([told.next().step for _ in range(501)], list(range(501)))
        self.assertEqual(snapshot().record.episode.length, 500)

    def test_02_an_observation_is_that_of_its_step(self):
        """Catches observations, rewards and sensor messages of the previous or the next state.
        The reference is Gymnasium's recorded numbers."""
        server = self.lockstep("Walker2d-v5")
        topics = {"transition": Transition, "observation": Float64MultiArray, "reward": Float64}
        topics.update({"joint_states": JointState, "odom": Odometry})
        told = {name: self.subscribe(server, f"/{name}", kind) for name, kind in topics.items()}
        recorded = next(e for e in read_walker2d() if e.id == "Walker2d-v5")
        for number, expected in enumerate(recorded.steps):
            if number == 0:
                reply = server.reset(has_seed=True, seed=recorded.seed)
            else:
                reply = server.step(action=expected.action)
                self.assertEqual(bits(reply.action), bits(expected.action))
            self.assertEqual(bits(reply.observation), bits(expected.observation), number)
            self.assertEqual(bits([reply.reward]), bits([expected.reward]), number)
            messages = {name: subscriber.next() for name, subscriber in told.items()}
            for name in ("transition", "joint_states", "odom"):
                self.assertEqual(nanoseconds(messages[name]), nanoseconds(reply), name)
            self.assertTrue(same_experience(messages["transition"], reply))
            self.assertEqual(bits(messages["observation"].data), bits(reply.observation))
            self.assertEqual(messages["reward"].data, reply.reward)
            # The observation begins with the torso's height and pitch, then the joints.
            self.assertEqual(messages["odom"].pose.pose.position.z, reply.observation[0])
            positions = messages["joint_states"].position
            self.assertEqual(bits(positions), bits(reply.observation[2:8]))
        self.assertGreater(number, 20)

    def test_03_a_reset_never_rewinds_time(self):
        """Catches a clock that goes back at a reset, an autoreset or a restart of the server: tf2
        would drop every later transform, and a rospy.Timer would end."""
        buffer = tf2_ros.Buffer()
        listener = tf2_ros.TransformListener(buffer)
        self.addCleanup(listener.unregister)
        transitions = self.record("/transition", Transition, 0)
        ticks = []
        timer = rospy.Timer(rospy.Duration(0.1), lambda event: ticks.append(event.current_real))
        self.addCleanup(timer.shutdown)

        def all_go_on(server):
            """Resets until tf has a newer transform and the timer has ticked."""
            newest, count = newest_transform(buffer), len(ticks)

            def gone_on():
                server.reset(has_seed=False)
                return newest_transform(buffer) > newest and len(ticks) > count

            wait_for(gone_on, "tf and the timer to go on")

        for end in (signal.SIGKILL, signal.SIGINT):
            server = self.lockstep()
            all_go_on(server)
            for seed in range(100):
                begun = server.reset(has_seed=True, seed=seed)
                self.assertEqual(nanoseconds(server.step(action=STAND)), nanoseconds(begun) + DT)
            all_go_on(server)
            server.stop(end)
        server = self.serve(real_time_factor=10.0, max_episode_steps=20)
        for _ in range(20):
            all_go_on(server)
        self.assert_grows([nanoseconds(message) for message in transitions.messages()])
        self.assertEqual(ticks, sorted(ticks))

    def test_04_a_reset_leaves_nothing_behind(self):
        """Catches velocities, contacts, warm starts, filters and held commands that survive a
        reset."""
        for env, effort, parameters in (
            ("BipedalWalker-v3", 80.0, {}),
            ("Walker2d-v5", 100.0, {"terminate_when_unhealthy": False}),
        ):
            actions = [zeros(env), *swaying(env, 15)]
            fresh = self.lockstep(env, "/fresh/walker_sim", publish_clock=False, **parameters)
            expected = self.play(fresh, 7, actions)
            fresh.stop()
            server = self.serve(env=env, command_timeout=0.0, **parameters)
            transitions = self.record("/transition", Transition)
            self.drive_violently(transitions, effort, swaying(env, 5))
            begun = server.reset(has_seed=True, seed=7)
            first = transitions.wait(lambda m, e=begun.episode: (m.episode, m.step) == (e, 1))
            self.assert_same([begun, first], expected[:2])  # the held command is cleared
            self.call("pause")
            self.assert_same(self.play(server, 7, actions), expected)
            transitions.close()
            server.stop()

    @staticmethod
    def drive_violently(transitions, effort, actions):
        """Commands three times these actions in turn; the last one stays held."""
        command = rospy.Publisher("/effort_command", Float64MultiArray, queue_size=1)
        wait_for(command.get_num_connections, "the server to listen")
        for action in actions:

            def is_held(wanted=tuple(3 * value for value in action)):
                command.publish(data=[effort * value for value in wanted])
                time.sleep(0.2)  # it arrives, and none is in flight afterwards
                return tuple(transitions.messages()[-1].action) == wanted

            wait_for(is_held, "the command to be held")  # again: an episode's end clears it
        command.unregister()

    def test_05_nothing_deadlocks_under_simulation_time(self):
        """Catches a server that answers only while time passes or waits for its subscribers, and a
        /clock that is first published at the first reset."""
        master = OwnMaster()  # a new one, on which there has been no /clock
        self.addCleanup(master.kill)
        rosgraph.Master(CALLER, master.uri).setParam("/use_sim_time", True)
        client = subprocess.Popen(
            [sys.executable, "-c", EARLY_NODE],
            env={**os.environ, "ROS_MASTER_URI": master.uri},
            stdout=subprocess.PIPE,
            encoding="utf-8",
        )
        self.addCleanup(client.stdout.close)
        self.addCleanup(client.wait)
        self.addCleanup(client.kill)
        self.assertEqual(client.stdout.readline(), "early\n")
        server = self.lockstep(max_episode_steps=0, master_uri=master.uri)
        self.assertEqual(client.wait(2 * PATIENCE), 0, server.output())
        told = client.stdout.read().splitlines()[-3:]  # rospy prints lines of its own before
        self.assertEqual(told, ["transition finished", "clock finished", "sleep finished"])
        server.stop()

    def test_06_nothing_is_sent_that_nobody_wants(self):
        """Catches messages published without subscribers, several /clock or /tf messages per step,
        and commands delayed by Nagle's algorithm."""
        server = self.lockstep(max_episode_steps=0)
        clock = self.subscribe(server, "/clock", Clock)
        frames = self.subscribe(server, "/tf", TFMessage)
        # This node and the server subscribe to /clock too; each new subscriber repeats the time.
        joined = {("/clock", rospy.get_name()), ("/clock", server.name)}
        wait_for(lambda: joined <= self.listeners(server), "those who listen to have joined")
        begun = nanoseconds(server.reset(has_seed=True, seed=1))
        while first_stamp(clock.next()) < begun:
            pass
        frames.next()
        for _ in range(200):  # one message each: a second would be read as the next step's
            stamp = nanoseconds(server.step(action=STAND))
            self.assertEqual([first_stamp(clock.next()), first_stamp(frames.next())], [stamp] * 2)
        # roscpp increments header.seq per published message, even without subscribers.
        kinds = {"/joint_states": JointState, "/odom": Odometry, "/imu": Imu, "/scan": LaserScan}
        for topic, kind in {**kinds, "/contacts": Contacts, "/transition": Transition}.items():
            subscriber = self.subscribe(server, topic, kind)
            server.step(action=STAND)
            self.assertEqual(subscriber.next().header.seq, 0, f"{topic} was published for nobody")

        command = rospy.Publisher("/effort_command", Float64MultiArray, queue_size=1)
        self.addCleanup(command.unregister)
        wait_for(command.get_num_connections, "the server to listen")
        connection = command.impl.connections[0].socket
        self.assertTrue(connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))

    @staticmethod
    def listeners(server):
        """Pairs of topic and subscribed node."""
        uri = rosgraph.Master(CALLER).lookupNode(server.name)
        infos = xmlrpc.client.ServerProxy(uri).getBusInfo(CALLER)[2]
        return {(topic, node) for _, node, way, _, topic, *_ in infos if way == "o"}

    def test_07_it_pauses_and_runs_the_same_at_any_pace(self):
        """Catches a pause that leaks steps, a pace limited to real time, and trajectories that
        depend on pace, mode or the origin of the steps."""
        for env, count in (("BipedalWalker-v3", 60), ("Walker2d-v5", 40)):
            parameters = {"env": env, "max_episode_steps": count}
            actions = [zeros(env)] * count
            runs = {"lockstep": self.play(self.lockstep(**parameters), 5, actions)}
            self.server.stop()
            free = {**parameters, "auto_reset": False, "paused": True}
            runs["paused"] = self.play(self.serve(**free), 5, actions)
            self.server.stop()
            for factor in (1.0, 20.0, 0.0):
                server = self.serve(real_time_factor=factor, **free)
                transitions = self.record("/transition", Transition)
                begun = server.reset(has_seed=True, seed=5)
                transitions.at(nanoseconds(begun))
                transitions.clear()
                time.sleep(0.1)
                self.assertEqual(transitions.messages(), [], "it moves while it is paused")
                self.call("unpause")
                transitions.wait(lambda m: m.truncated, "the end")
                runs[factor] = [begun, *transitions.messages()]
                transitions.close()
                server.stop()
            for run in runs.values():
                self.assert_same(run, runs["lockstep"])
        server = self.serve(real_time_factor=0.0)
        clock = self.record("/clock", Clock)
        begin, first = time.monotonic(), clock.wait().clock
        clock.wait(lambda m: (m.clock - first).to_sec() > 20, "20 s of simulation time")
        self.assertLess(time.monotonic() - begin, 20, "it is not faster than real time")

    def test_08_the_same_seed_gives_the_same_trajectory(self):
        """Catches seeds that are truncated to 32 bits, ignored or mixed with earlier state,
        differences between servers or restarts, and deviations from Gymnasium's numbers."""
        for env in ACTION_SIZES:
            actions = swaying(env, 8)
            runs = []
            for name in ("/walker_sim", "/second/walker_sim", "/walker_sim"):
                server = self.lockstep(env, name, publish_clock=False)
                runs.append([self.play(server, seed, actions) for seed in SEEDS])
                server.stop()
            for run in runs[1:]:
                for one, other in zip(run, runs[0]):
                    self.assert_same(one, other)
            starts = {bits(episode[0].observation) for episode in runs[0]}
            self.assertEqual(len(starts), len(SEEDS), "two seeds begin alike")
        episodes = read_walker2d() + read_bipedal_walker()
        for environment, group in itertools.groupby(episodes, lambda e: (e.id, e.parameters)):
            server = self.lockstep(environment[0], **environment[1])
            for recorded in group:
                self.assert_gymnasium_s(server, recorded)
            server.stop()

    def assert_gymnasium_s(self, server, recorded):
        """Plays Gymnasium's actions and compares the results bitwise."""
        told = self.play(server, recorded.seed, [step.action for step in recorded.steps[1:]])
        for transition, expected in zip(told, recorded.steps):
            what = f"{recorded.id}, seed {recorded.seed}, step {transition.step}"
            self.assertEqual(bits(transition.observation), bits(expected.observation), what)
            self.assertEqual(bits([transition.reward]), bits([expected.reward]), what)
            flags = (transition.terminated, transition.truncated)
            self.assertEqual(flags, (expected.terminated, expected.truncated), what)
            self.assertEqual(bits(transition.info), bits(expected.info), what)

    def test_09_one_master_serves_many_environments(self):
        """Catches topics, services or parameters that two servers share, and environments that
        disturb each other, with one engine or two."""
        envs = ["BipedalWalker-v3", "Walker2d-v5"] * 2
        alone = {}
        for env in ACTION_SIZES:
            server = self.lockstep(env, "/alone/walker_sim", publish_clock=False)
            alone[env] = self.play(server, 3, swaying(env, 10))
            server.stop()
        servers = [
            self.lockstep(env, f"/number_{i}/walker_sim", publish_clock=i == 0)
            for i, env in enumerate(envs)
        ]
        runs = [[server.reset(has_seed=True, seed=3)] for server in servers]
        for i in range(10):
            for env, server, run in zip(envs, servers, runs):
                run.append(server.step(action=swaying(env, 10)[i]))
        for env, run in zip(envs, runs):
            self.assert_same(run, alone[env])
        shared = {"/clock", "/tf", "/tf_static", "/diagnostics", "/rosout"}
        publishers, subscribers, services = rosgraph.Master(CALLER).getSystemState()
        for name, nodes in (*publishers, *subscribers, *services):
            ours = [node for node in nodes if node.startswith("/number_")]
            if name not in shared:
                self.assertLessEqual(len(ours), 1, name)
        self.assertEqual(dict(publishers)["/clock"], [servers[0].name])

    def test_10_nothing_dies_hangs_or_stays_behind(self):
        """Catches servers that crash on a client's death or garbage, hang at shutdown or leave
        registrations behind, and agents that do not survive a restart of their server."""
        rospy.set_param("/agent", {"agent": "random"})
        self.addCleanup(rospy.delete_param, "/agent")
        agent = Process("topic_agent", "/agent")
        self.addCleanup(agent.end)
        for end in (signal.SIGKILL, signal.SIGINT, signal.SIGTERM):
            server = self.serve(max_episode_steps=0)
            transitions = self.record("/transition", Transition)
            self.ill_treat(server)
            transitions.clear()
            transitions.wait(lambda m: any(m.action), "the agent to drive the next server")
            transitions.close()
            if end == signal.SIGKILL:
                server.kill()
                self.assertTrue(registrations(server.name), "the next one meets none")
            else:
                self.assertEqual(server.stop(end, PROMPT), 0, server.output())
                self.assertEqual(registrations(server.name), [])
        self.assertEqual(agent.stop(signal.SIGINT, PROMPT), 0, agent.output())
        self.assertEqual(registrations(agent.name), [])

        launched = Launched("walker.launch", "env:=Walker2d-v5", "agent:=random", "rviz:=false")
        self.addCleanup(launched.stop)
        self.record("/transition", Transition).wait(lambda m: any(m.action), "all to run")
        # Server, agent and status_line, which may start last.
        wait_for(lambda: len(launched.pids()) >= 3, "all nodes to run")
        pids = launched.pids()
        self.assertEqual(launched.stop(), 0, launched.output())
        self.assertEqual([pid for pid in pids if os.path.exists(f"/proc/{pid}")], [])
        self.assertEqual(registrations("/walker_sim") + registrations("/agent"), [])

    def ill_treat(self, server):
        """Sends garbage and half a request, and disconnects during a call."""
        for rubbish in (b"\xff" * 64, b"GET / HTTP/1.1\r\n\r\n", struct.pack("<I", 40)):
            with server.service_address("step") as connection:
                connection.sendall(rubbish)
        for size in (3, None):
            client = server.client("reset", Reset)
            client.connection.sendall(client.request_bytes(has_seed=True, seed=1)[:size])
            client.close()
        server.reset(has_seed=True, seed=2)


if __name__ == "__main__":
    rospy.init_node("ten_pains_test")
    rostest.rosrun("walker_sim", "ten_pains_test", TenPainsTest, sys.argv)
