"""The server is killed at random times and respawned: a prompt error, then correct bits again."""

import os
import signal
import threading
import time

import walker_sim
from graph import STARTUP_TIMEOUT, await_true, command_of
from launched import children_of
from walk import Pair
from walker_sim.srv import Reset

TIMEOUT = 2.0  # client's timeout [s]
SLACK = 1.0  # allowance for a busy machine [s]


def server_of(launch):
    for pid, state in children_of(launch.pid).items():
        if state != "Z" and command_of(pid)[:1] and command_of(pid)[0].endswith("/server"):
            return pid
    return None


def kill_server(launch, times):
    pid = server_of(launch)
    times.append(time.monotonic())
    os.kill(pid, signal.SIGKILL)


def run(soak):
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
            killer = threading.Timer(soak.random.uniform(0, 0.3), kill_server, [launch, killed])
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
