"""Load by many clients, environments, resets, servers or subscribers."""

import functools
import selectors
import socket
import struct
import threading
from concurrent.futures import ThreadPoolExecutor

import gymnasium
import numpy as np
import usage
from bare_ros import BareSubscriber, header_bytes, read_header, receive_reply, request_bytes
from graph import await_true
from processes import CALLER, processor_time
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray
from walk import Pair
from walker_sim.msg import Transition
from walker_sim.srv import Reset, Step

IDS = ("BipedalWalker-v3", "Walker2d-v5", "Hopper-v5", "BipedalWalkerHardcore-v3")


def many_clients(soak):
    """Clients that connect, call once and disconnect, one after another."""
    with soak.graph() as graph:
        server = graph.server(max_episode_steps=0)
        reset = graph.client(f"{server.name}/reset", Reset)
        address = graph.address(f"{server.name}/step")
        fields = {"callerid": CALLER, "service": f"{server.name}/step", "md5sum": Step._md5sum}
        request = header_bytes(fields) + request_bytes(Step, action=[1.0, 1.0, -1.0, 1.0])
        reset(has_seed=True, seed=1)
        watched, latency, wrong = usage.Usage(server.pid), usage.Latency(), 0
        soak.begin()
        for number in soak.repeats():
            if number % 1000 == 0:
                reset(has_seed=True, seed=1)
            with latency:
                reply = call_once(address, request)
            wrong += not (reply.success and reply.transition.step == number % 1000 + 1)
            watched.sample()
        clients = number + 1
        soak.check("each client's one call is made once", wrong == 0, f"{wrong} of {clients}")
        watched.check(soak.tally, "the server", f"{clients:,} clients")
        watched.check_handles(soak.tally, "the server")
        latency.check(soak.tally, "connecting and a step")
        soak.figure("clients one after the other", f"{clients:,}")


def call_once(address, request):
    """Calls on a connection that the server closes after its answer."""
    with socket.create_connection(address, timeout=30) as connection:
        connection.sendall(request)
        read_header(connection)
        fine, data = receive_reply(connection)
        assert fine, data
        assert connection.recv(1) == b"", "more than an answer"
    return Step._response_class().deserialize(data)


NUM_ENVS = 1024
EPISODE = 100  # steps; then most environments reset together and heaps peak
# The heaps of this many walkers fluctuate by some MiB. A leak of 16 bytes per step and walker takes
# 16 MiB in 1000 steps of all.
MAX_GROWTH = usage.MAX_GROWTH + NUM_ENVS * usage.PAGE
TIMEOUT = 600.0  # client's timeout [s]; all other parts have priority
NUM_RESET = 64  # environments that reset together


def vector_pair(graph, env_id, num_envs, timeout, **parameters):
    """Starts a server. Returns it, its environments and the same environments in this process."""
    server = graph.server(env=env_id, num_envs=num_envs, **parameters)
    place = {"transport": "ros", "server": server.name, "master_uri": graph.uri}
    make = functools.partial(gymnasium.make_vec, f"walker_sim/{env_id}", num_envs, **parameters)
    return server, make(timeout=timeout, **place), make()


def same(one, other):
    return all(a.tobytes() == b.tobytes() for a, b in zip(one[:-1], other[:-1]))


def many_environments(soak):
    """1024 environments on one server, stepped together."""
    with soak.graph() as graph:
        server, remote, local = vector_pair(
            graph, IDS[0], NUM_ENVS, TIMEOUT, max_episode_steps=EPISODE
        )
        equal = same(remote.reset(seed=1), local.reset(seed=1))
        random = np.random.default_rng(soak.random.randrange(1 << 32))
        watched, latency = usage.Usage(server.pid), usage.Latency()
        spent = [processor_time(server.pid)]
        soak.begin()
        for _ in soak.repeats():
            actions = random.uniform(-1, 1, remote.action_space.shape).astype(np.float32)
            with latency:
                theirs = remote.step(actions)
            equal = same(theirs, local.step(actions)) and equal
            spent.append(processor_time(server.pid))
            watched.sample()
        soak.check(f"{NUM_ENVS} environments have the bits of those in process", equal)
        work = f"{len(spent) - 1:,} steps of {NUM_ENVS} environments"
        watched.check(soak.tally, "the server", work, MAX_GROWTH)
        latency.check(soak.tally, f"a step of {NUM_ENVS} over ROS", is_alone=False)
        if watched.is_long_enough():
            check_work(soak, spent)
        remote.close()
        local.close()
        soak.check("threads stay the same", usage.now(server.pid)[2] == watched.before[2])


def check_work(soak, spent):
    """Checks the processor time of a step, on which other load has little influence.

    Parameters
    ----------
    spent
        Processor time of the server before the first step and after each step [s].
    """
    fifth = max(1, len(spent) // 5)
    first, last = (
        (part[-1] - part[0]) / fifth for part in (spent[: fifth + 1], spent[-fifth - 1 :])
    )
    figures = f"{first * 1e3:.1f}; {last * 1e3:.1f}"
    soak.check("the work of a step stays below twice the first", last < 2 * first, figures)
    soak.figure(f"processor time of a step of {NUM_ENVS} at first; at last [ms]", figures)


def many_resets(soak):
    """Repeated resets: constant memory and correct bits."""
    resets = sum(reset_often(soak, env_id, soak.seconds / len(IDS)) for env_id in IDS)
    soak.figure("resets", f"{resets:,}")


def reset_often(soak, env_id, seconds):
    with soak.graph() as graph:
        server, remote, local = vector_pair(graph, env_id, NUM_RESET, 60.0)
        zero = np.zeros(remote.action_space.shape, np.float32)
        remote.reset(seed=0)
        remote.step(zero)
        watched, latency, equal = usage.Usage(server.pid), usage.Latency(), True
        soak.begin(seconds)
        for call in soak.repeats():
            seed = soak.random.randrange(1 << 40)
            with latency:
                theirs = remote.reset(seed=seed)[0]
            if call % 20 == 0:
                equal = equal and theirs.tobytes() == local.reset(seed=seed)[0].tobytes()
                equal = equal and remote.step(zero)[0].tobytes() == local.step(zero)[0].tobytes()
            watched.sample()
        resets = (call + 1) * NUM_RESET
        soak.check("after many resets the bits are right", equal, env_id)
        watched.check(soak.tally, f"a server of {env_id}", f"{resets:,} resets")
        watched.check_handles(soak.tally, "the server")
        latency.check(soak.tally, f"{NUM_RESET} resets of {env_id}")
        remote.close()
        local.close()
    return resets


SERVERS = 10


def many_servers(soak):
    """Ten servers on one master, each with its own agent."""
    with soak.graph() as graph:
        servers, pairs = [], []
        for number in range(SERVERS):
            env_id = IDS[number % len(IDS)]
            servers.append(graph.server(f"/walker_{number}", env=env_id, publish_clock="false"))
            pairs.append(Pair(servers[-1].name, graph.uri, 30.0, env_id))
        soak.begin()

        def walk(number):
            pair, steps = pairs[number], 0
            pair.reset(number)
            pair.step()
            watched, equal = usage.Usage(servers[number].pid), True
            while steps == 0 or soak.goes_on():
                equal = pair.steps(50) and equal
                steps += 50
                watched.sample()
            return watched, equal, steps

        with ThreadPoolExecutor(SERVERS) as threads:
            results = list(threads.map(walk, range(SERVERS)))
        for number, (watched, equal, _) in enumerate(results):
            soak.check(f"each of {SERVERS} servers returns the right bits", equal, number)
            watched.check(soak.tally, f"each of {SERVERS} servers")
            watched.check_handles(soak.tally, "each server")
            pairs[number].close()
        growth = max((one.growth() for one, *_ in results if one.is_long_enough()), default=0.0)
        soak.figure(
            f"{SERVERS} servers, {sum(steps for *_, steps in results):,} steps: largest growth in"
            " the second half",
            f"{growth / usage.MIB:+.2f} MiB",
        )


SUBSCRIBERS = 50
SILENT = {"/transition": Transition, "/tf": TFMessage, "/state_markers": MarkerArray}
SILENT_EACH = 5


class Readers:
    def __init__(self, uri):
        self._selector = selectors.DefaultSelector()
        self._over = False
        self.subscribers = [
            BareSubscriber(uri, "/transition", Transition) for _ in range(SUBSCRIBERS)
        ]
        self.received = {subscriber: [] for subscriber in self.subscribers}
        self._bytes = {subscriber: b"" for subscriber in self.subscribers}
        for subscriber in self.subscribers:
            self._selector.register(subscriber.connection, selectors.EVENT_READ, subscriber)
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self):
        while not self._over:
            for key, _ in self._selector.select(0.1):
                subscriber = key.data
                data = self._bytes[subscriber] + subscriber.connection.recv(1 << 20)
                while len(data) >= 8 and len(data) >= 4 + struct.unpack_from("<I", data)[0]:
                    size, sequence = struct.unpack_from("<II", data)
                    self.received[subscriber].append(sequence)
                    data = data[4 + size :]
                self._bytes[subscriber] = data

    def have(self, count):
        return all(len(received) >= count for received in self.received.values())

    def close(self):
        self._over = True
        self._thread.join()
        for subscriber in self.subscribers:
            subscriber.close()


def many_subscribers(soak):
    """50 subscribers that receive every step in order, and 15 that never read: the walker's bits
    stay correct."""
    with soak.graph() as graph:
        server = graph.server()
        pair = Pair(server.name, graph.uri, 10.0)
        pair.reset(0)
        pair.step()
        watched, latency = usage.Usage(server.pid), usage.Latency()
        uri = graph.node_uri(server.name)
        readers = Readers(uri)
        silent = [
            BareSubscriber(uri, t, kind) for t, kind in SILENT.items() for _ in range(SILENT_EACH)
        ]
        soak.begin()
        for number in soak.repeats():
            equal = True
            for _ in range(50):  # less than the queue size
                with latency:
                    equal = pair.step() and equal
            soak.check("the bits are right", equal)
            steps = 50 * (number + 1)
            await_true(functools.partial(readers.have, steps), "all subscribers to have all steps")
            watched.sample()
        in_order = all(r == list(range(r[0], r[0] + steps)) for r in readers.received.values())
        soak.check(f"each of {SUBSCRIBERS} subscribers gets each step once and in order", in_order)
        watched.check(soak.tally, "the server", f"{steps:,} steps to {SUBSCRIBERS} subscribers")
        latency.check(soak.tally, f"a step beside {SUBSCRIBERS + len(silent)} subscribers")
        readers.close()
        for subscriber in silent:
            subscriber.close()
        pair.steps(5)  # the server notices closed connections when it writes
        watched.check_handles(soak.tally, "the server")
        pair.close()
