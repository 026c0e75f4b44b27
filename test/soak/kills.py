"""Clients, masters, rviz and servers are killed at random moments; each part says what goes on."""

import os
import shutil
import signal
import sys
import threading
import time
import xmlrpc.client

import usage
import walker_sim
from bare_ros import BareSubscriber, header_bytes, request_bytes
from graph import ROOT, await_true, command_of
from processes import CALLER, EXIT_TIMEOUT, STARTUP_TIMEOUT, children_of, start_screen
from walk import Pair
from walker_sim.msg import Transition
from walker_sim.srv import Reset, Step

TIMEOUT = 2.0  # client's timeout [s]
SLACK = 1.0  # allowance for a busy machine [s]

# Sends the header, then the request in a loop. Does not import this package, to start sooner.
VICTIM = """
import socket, sys
host, port, header, request = sys.argv[1:]
connection = socket.create_connection((host, int(port)))
connection.sendall(bytes.fromhex(header))
print("runs", flush=True)
while True:
    connection.sendall(bytes.fromhex(request))
    connection.recv(4096)
"""


def kill_client(soak):
    """Clients are killed amid their calls: other clients are unaffected, and nothing leaks."""
    with soak.graph() as graph:
        server = graph.server()
        pair = Pair(server.name, graph.uri, 10.0)
        pair.reset(1)
        pair.step()
        fields = {"callerid": CALLER, "service": f"{server.name}/step", "persistent": "1"}
        header = header_bytes({**fields, "md5sum": Step._md5sum})
        host, port = graph.address(f"{server.name}/step")
        watched = usage.Usage(server.pid)
        request = request_bytes(Step, action=[0.1, -0.1, 0.2, 0.0])
        for number in soak.rounds():
            words = [host, port, header.hex(), request.hex()]
            victim = graph.start([sys.executable, "-S", "-c", VICTIM, *words])
            await_true(lambda v=victim: "runs" in v.output(), "the client", process=victim)
            time.sleep(soak.random.uniform(0, 0.05))
            victim.kill()
            # The server still executes a request that it has received. Once it serves a later
            # client, the victim's connection is no longer in the backlog.
            graph.client(f"{server.name}/step", Step).close()
            await_true(
                lambda: usage.now(server.pid)[1] <= watched.before[1], "its connection to go"
            )
            equal = pair.reset(soak.random.randrange(1 << 32)) and pair.steps(20)
            soak.check("another client's bits are right", equal, f"round {number}")
        soak.check("the server runs", server.is_running(), server.output())
        watched.check_handles(soak.tally, "the server")
        pair.close()


def kill_master(soak):
    """Connected clients go on, new clients get an error, and the server can end."""
    for number in soak.rounds():
        with soak.graph() as graph:
            server = graph.server()
            pair = Pair(server.name, graph.uri, TIMEOUT)
            equal = pair.reset(number) and pair.step()  # opens both connections
            killer = threading.Timer(soak.random.uniform(0, 0.1), graph.process.kill)
            killer.start()
            while killer.is_alive():
                equal = pair.step() and equal
            killer.join()
            equal = pair.steps(300) and equal and pair.reset(number) and pair.steps(20)
            soak.check("steps and resets go on, with the right bits", equal, f"round {number}")
            begin, message = time.monotonic(), ""
            try:
                Pair(server.name, graph.uri, TIMEOUT)
            except walker_sim.ConnectionError as error:
                message = str(error)
            soak.check(
                "a new client gets an error that names the master, within its timeout",
                "master" in message and time.monotonic() - begin < TIMEOUT + SLACK,
                message,
            )
            pair.close()
            by = soak.random.choice([signal.SIGINT, signal.SIGTERM])
            status = server.end(by)
            soak.check(
                f"the server ends within {EXIT_TIMEOUT} s after a signal",
                status == 0,
                f"status {status} after {by.name}: {server.output()}",
            )


def kill_rviz(soak):
    """The walker walks on, and the server leaks nothing."""
    missing = [name for name in ("rviz", "Xvfb") if not shutil.which(name)]
    if missing:
        soak.leave_out(f"without {' and '.join(missing)}")
        return
    with soak.graph() as graph:
        display = start_screen(graph.start, "800x600")
        server = graph.server(mode="free")
        subscriber = BareSubscriber(graph.node_uri(server.name), "/transition", Transition)
        watched, last = None, subscriber.next()
        environment = {"DISPLAY": display, "LIBGL_ALWAYS_SOFTWARE": "1"}
        command = ["rviz", "-d", ROOT / "config" / "bipedal_walker.rviz"]
        for _ in soak.rounds():
            viewer = graph.start(command, environment=environment)
            await_true(lambda: listens(graph), "rviz to listen")
            time.sleep(soak.random.uniform(0, 1))
            viewer.kill()
            stamp = last.header.stamp
            end, gaps = time.monotonic() + 0.2, 0
            while time.monotonic() < end:
                following = subscriber.next()
                gaps += (following.header.stamp - last.header.stamp).to_nsec() != 20_000_000
                last = following
            soak.check("the walker walks on, step by step", gaps == 0 and last.header.stamp > stamp)
            forget(graph)
            if watched is None:
                time.sleep(1)  # after the first rviz, the server has loaded everything it needs
                watched = usage.Usage(server.pid)
        watched.check_handles(soak.tally, "the server")
        soak.check("the server runs", server.is_running(), server.output())
        subscriber.close()


def listens(graph):
    state = graph.ask("getSystemState")
    return state and any(topic == "/scene_markers" for topic, _ in state[1])


def forget(graph):
    """Removes the killed rviz's registrations, which stay; the next rviz has another name."""
    for topic, nodes in graph.ask("getSystemState")[1]:
        for node in nodes:
            if node.startswith("/rviz"):
                with xmlrpc.client.ServerProxy(graph.uri) as master:
                    master.unregisterSubscriber(node, topic, graph.node_uri(node) or "")


def kill_server(soak):
    """A client gets a prompt error and, from the respawned server, correct bits again."""
    max_error_delay, max_gap = 0.0, 0.0
    with soak.graph() as graph:
        arguments = ["mode:=lockstep", "respawn:=true", "status:=false", "headless:=true"]
        launch = graph.start(["roslaunch", "walker_sim", "walker.launch", *arguments])
        await_true(lambda: graph.service_uri("/walker_sim/set_physics_properties"), "the server")
        pair = Pair("/walker_sim", graph.uri, TIMEOUT)
        last = stamp_after_reset(graph)
        for number in soak.rounds():
            equal = pair.reset(soak.random.randrange(1 << 32))
            killed = []
            killer = threading.Timer(soak.random.uniform(0, 0.3), kill_server_of, [launch, killed])
            killer.start()
            error = None
            end = time.monotonic() + STARTUP_TIMEOUT
            while error is None and time.monotonic() < end:
                try:
                    equal = pair.step() and equal
                except walker_sim.ConnectionError as raised:
                    error = raised
            raised_at = time.monotonic()
            killer.join()
            max_error_delay = max(max_error_delay, raised_at - killed[0])
            soak.check("the client's bits are right up to the kill", equal, f"round {number}")
            soak.check(
                "the client gets an error that names the service, within its timeout",
                "/walker_sim" in str(error) and raised_at - killed[0] < TIMEOUT + SLACK,
                f"{error} after {raised_at - killed[0]:.2f} s",
            )
            equal = await_true(lambda: works_again(pair, soak), "the respawned server")
            max_gap = max(max_gap, time.monotonic() - killed[0])
            soak.check("after the respawn the bits are right", equal == "equal", f"round {number}")
            stamp = stamp_after_reset(graph)
            soak.check(
                "time continues above all published stamps", stamp > last, f"{last}, {stamp}"
            )
            last = stamp
        pair.close()
        status = launch.end(signal.SIGINT)
        soak.check("the launch ends on SIGINT", status == 0, f"status {status}")
    soak.figure("longest time from a kill to the client's error [s]", f"{max_error_delay:.3f}")
    soak.figure("longest time from a kill until it serves again [s]", f"{max_gap:.1f}")


def works_again(pair, soak):
    try:
        return "equal" if pair.reset(soak.random.randrange(99)) and pair.steps(20) else "other"
    except walker_sim.ConnectionError:
        time.sleep(0.02)
        return ""


def stamp_after_reset(graph):
    """Returns the transition's stamp [ns]."""
    client = graph.client("/walker_sim/reset", Reset)
    try:
        return client(has_seed=True, seed=1).transition.header.stamp.to_nsec()
    finally:
        client.close()


def server_of(launch):
    for pid, state in children_of(launch.pid).items():
        if state != "Z" and command_of(pid)[:1] and command_of(pid)[0].endswith("/server"):
            return pid
    return None


def kill_server_of(launch, times):
    pid = server_of(launch)
    times.append(time.monotonic())
    os.kill(pid, signal.SIGKILL)
