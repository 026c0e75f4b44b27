"""Measurements over ROS: lock-step, batches, free-running mode, start-up."""

import pathlib
import sys
import time

from measure import Failure, Plan, Row, against, run_slice, steps_per_second
from ros import Master, await_true, call_service, diagnostics, place, stop

WALKER, WALKER2D = "BipedalWalker-v3", "Walker2d-v4"
BATCHES = (1, 8, 64, 512)
PLACEMENTS = {1: "1 core", 2: "2 cores"}
# Bytes of ~step's request and response for BipedalWalker-v3, with length fields and flags.
REQUEST, RESPONSE = 40, 300
LEAST_PERIOD = 0.5  # of the diagnostics, long enough for a few steps [s]
LOCKSTEP_ROSPY = pathlib.Path(__file__).with_name("lockstep_rospy.py")


def lockstep(settings):
    """One environment stepped by service, client and server on one core or on two. The same without
    physics, beside a raw TCP connection with messages of the same size."""
    plan = Plan("lockstep", "steps/s", steps_per_second, settings.folder)
    seconds = ["--seconds", settings.seconds(0.6)]
    rounds = settings.rounds(4)
    rows = []
    with Master(settings) as master:
        walker, walker_process = master.server(mode="lockstep", env=WALKER)
        null, null_process = master.server(
            "walker_sim_null_server", "/null", mode="lockstep", env=WALKER, publish_clock="false"
        )
        sizes = ["--request-bytes", REQUEST, "--response-bytes", RESPONSE]
        ping_pong = settings.programs / "walker_sim_ping_pong"
        port, ping_pong_process = master.ping_pong([ping_pong, "serve", *sizes])
        clients = settings.programs / "walker_sim_lockstep_client"
        for cores in (settings.one_core, settings.two_cores):
            plan.jobs.clear()
            for process in (walker_process, null_process, ping_pong_process):
                place(process, cores)

            def add(side, command, cores=cores):
                placement = PLACEMENTS[len(cores)]
                return plan.add(side, WALKER, command, cores, placement=placement)

            def client(kind, server):
                return [clients, "--client", kind, "--server", server, *seconds]

            served = [
                add("our client", client("ours", walker)),
                add("roscpp", client("roscpp", walker)),
                add("rospy", [sys.executable, LOCKSTEP_ROSPY, "--server", walker, *seconds]),
                add(
                    "gymnasium.make",
                    settings.python("lockstep", WALKER, "--server", walker, *seconds),
                ),
            ]
            peer = settings.peer("gymnasium-lockstep", WALKER, *seconds)
            gymnasium = add("Gymnasium in process", peer)
            for ours in served:
                against(ours, gymnasium)
            ours = add("our client, no physics", client("ours", null))
            peer = [ping_pong, "run", "--port", port, *sizes, *seconds]
            against(ours, add("raw TCP", peer))
            rows += plan.run(rounds)
    return rows + lockstep_of_walker2d(settings)


def lockstep_of_walker2d(settings):
    plan = Plan("lockstep", "steps/s", steps_per_second, settings.folder)
    seconds = ["--seconds", settings.seconds(0.6)]
    cores = settings.one_core
    with Master(settings) as master:
        walker, process = master.server(mode="lockstep", env=WALKER2D)
        place(process, cores)

        def add(side, command):
            return plan.add(side, WALKER2D, command, cores, placement=PLACEMENTS[len(cores)])

        client = settings.programs / "walker_sim_lockstep_client"
        ours = add("our client", [client, "--client", "ours", "--server", walker, *seconds])
        peer = settings.peer("gymnasium-lockstep", WALKER2D, *seconds)
        against(ours, add("Gymnasium in process", peer))
        return plan.run(settings.rounds(4))


def step_batch(settings):
    plan = Plan("step_batch", "steps/s", steps_per_second, settings.folder)
    cores = settings.two_cores
    threads = {"threads": len(cores)}
    seconds = ["--seconds", settings.seconds(0.4)]
    with Master(settings) as master:
        batches = {}
        for size in BATCHES:
            name, _ = master.server(
                namespace=f"/batch_{size}",
                mode="lockstep",
                env=WALKER,
                num_envs=size,
                num_threads=len(cores),
                publish_clock=str(size == BATCHES[0]).lower(),
            )
            command = [settings.programs / "walker_sim_batch_client", "--server", name, *seconds]
            batches.update(plan.add("step_batch", WALKER, command, cores, (size,), **threads))
        command = ["--num-envs", ",".join(map(str, BATCHES)), "--threads", len(cores), *seconds]
        command = settings.ours("pool", WALKER, *command)
        against(batches, plan.add("pool in process", WALKER, command, cores, BATCHES, **threads))
        return plan.run(settings.rounds(4))


def free(settings):
    """Free-running mode with the heuristic as a topic agent, from the server's diagnostics."""
    rows = []
    for env in (WALKER, "Walker2d-v5"):
        fastest = Row("free", env, "highest real-time factor", "")
        rows.append(fastest)
        watch(settings, env, 0, 2, {"real_time_factor": fastest})
        jitters = {
            f"jitter_{key}_us": Row("free", env, f"jitter {text} [us]", "us")
            for key, text in (("p50", "p50"), ("p99", "p99"), ("p999", "p99.9"), ("max", "max"))
        }
        rows += jitters.values()
        watch(settings, env, 1, 8, jitters)
    return rows


def watch(settings, env, factor, period, rows):
    """Appends the values of two reports to the rows, keyed by their names in the diagnostics. The
    first report of all covers the paused start-up: it has elapsed time but no intervals."""
    period = max(settings.seconds(period), LEAST_PERIOD)
    parameters = {"env": env, "real_time_factor": factor, "diagnostic_period": period}
    try:
        with Master(settings) as master:
            master.server(mode="free", paused="true", **parameters)
            master.process([settings.programs / "topic_agent", "_agent:=heuristic"])
            call_service("/walker_sim/unpause")
            skipped = 1 if factor == 0 else 0
            for report in diagnostics(2 + skipped, period)[skipped:]:
                for key, row in rows.items():
                    row.values.append(float(report[key]))
    except (Failure, KeyError, ValueError) as failure:
        for row in rows.values():
            row.error = f"{type(failure).__name__}: {failure}"


def start(settings):
    """Time from the start of roslaunch, with a running master, to the first answered step."""
    rows = []
    for env in (WALKER, "Walker2d-v5"):
        row = Row("start", env, "roslaunch", "s")
        rows.append(row)
        try:
            with Master(settings) as master:
                for _ in range(settings.rounds(3)):
                    row.values.append(seconds_to_the_first_step(settings, master, env))
        except Failure as failure:
            row.error = str(failure)
    return rows


def seconds_to_the_first_step(settings, master, env):
    service = "/walker_sim/step_batch"
    client = settings.programs / "walker_sim_batch_client"
    arguments = [f"env:={env}", "mode:=lockstep", "rviz:=false", "status:=false"]
    begin = time.perf_counter()
    process = master.process(["roslaunch", "walker_sim", "walker.launch", *arguments])
    try:
        master.await_service(service, process)
        command = [client, "--server", "/walker_sim", "--seconds", "1e-6"]
        run_slice(command, settings.two_cores, settings.folder)
        seconds = time.perf_counter() - begin
    finally:
        stop(process)
    await_true(lambda: not master.has_service(service), f"the end of {service}")
    return seconds
