"""Measurements over ROS: lock-step, batches, free-running mode, start-up."""

import pathlib
import sys
import time

from measure import Failure, Plan, Row, against, run_slice, steps_per_second
from ros import Master, await_true, call_service, diagnostics, place, stop

WALKER, WALKER2D = "BipedalWalker-v3", "Walker2d-v4"
BATCHES = (1, 8, 64, 512)
# Sizes of ~step's request and response for BipedalWalker-v3, with length fields and flags.
MESSAGE_SIZES = ("--request-bytes", 40, "--response-bytes", 300, "--spin-us", 50)
MIN_PERIOD = 0.5  # of the diagnostics, long enough for a few steps [s]
LOCKSTEP_ROSPY = pathlib.Path(__file__).with_name("lockstep_rospy.py")


def lockstep(settings):
    """One environment stepped by service, client and server on one core or free to use two. Also
    without physics, beside a raw TCP connection with messages of the same size, and with a server
    that does not poll before it blocks."""
    rows = []
    cores_of = (settings.one_core, settings.two_cores)
    with Master(settings) as master:
        null_options = {"mode": "lockstep", "env": WALKER, "publish_clock": "false"}
        null = master.server("walker_sim_null_server", "/null", **null_options)
        for env in (WALKER, WALKER2D):
            options = {"mode": "lockstep", "env": env}
            server = master.server(namespace=f"/{env[:8]}", **options)
            options.update(publish_clock="false", spin_us=0)
            blocking = master.server(namespace=f"/{env[:8]}_blocking", **options)
            for cores in cores_of:
                for _, process in (server, blocking, null):
                    place(process, cores)
                rows += lockstep_on(settings, env, cores, server[0], blocking[0], null[0])
            stop(server[1])
            stop(blocking[1])
    return rows


def lockstep_on(settings, env, cores, server, blocking, null):
    plan = Plan("lockstep", "steps/s", steps_per_second, settings.folder)
    seconds = ["--seconds", settings.seconds(0.6)]

    def add(side, command):
        placement = f"{len(cores)} core{'s' if len(cores) > 1 else ''}"
        return plan.add(side, env, command, cores, placement=placement)

    def client(program, *options):
        return [settings.programs / f"walker_sim_{program}", *options, *seconds]

    python = settings.python("gymnasium", env, "--server", server, *seconds)
    sides = [
        add("our client", client("benchmark", "client", "--server", server)),
        add("gymnasium.make", python),
    ]
    if env == WALKER:
        for text, name in (("", server), (", spin_us 0", blocking)):
            rospy = [sys.executable, LOCKSTEP_ROSPY, "--server", name, *seconds]
            sides.append(add(f"roscpp{text}", client("lockstep_roscpp", "--server", name)))
            sides.append(add(f"rospy{text}", rospy))
        ours = add("our client, no physics", client("benchmark", "client", "--server", null))
        against(ours, add("raw TCP", client("ping_pong", *MESSAGE_SIZES)))
    gymnasium = add("Gymnasium in process", settings.peer("gymnasium", env, *seconds))
    for ours in sides:
        against(ours, gymnasium)
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
            command = [settings.programs / "walker_sim_benchmark", "batch", "--server", name]
            command += seconds
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
    period = max(settings.seconds(period), MIN_PERIOD)
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
    arguments = [f"env:={env}", "mode:=lockstep", "rviz:=false", "status:=false"]
    begin = time.perf_counter()
    process = master.process(["roslaunch", "walker_sim", "walker.launch", *arguments])
    try:
        master.await_service(service, process)
        command = [settings.programs / "walker_sim_benchmark", "batch", "--server", "/walker_sim"]
        command += ["--seconds", "1e-6"]
        run_slice(command, settings.two_cores, settings.folder)
        seconds = time.perf_counter() - begin
    finally:
        stop(process)
    await_true(lambda: not master.has_service(service), f"the end of {service}")
    return seconds
