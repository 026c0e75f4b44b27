"""Measurements over ROS: lock-step, batches, free-running mode, start-up."""

import functools
import pathlib
import sys
import time
from tempfile import TemporaryDirectory
from typing import NamedTuple, Sequence

from measure import Failure, Plan, Row, against, run_slice, steps_per_second
from ros import Master, await_true, call_service, diagnostics, stop

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "server"))
from launched import start_screen

WALKER, WALKER2D = "BipedalWalker-v3", "Walker2d-v4"
BATCHES = (1, 8, 64, 512)
# Sizes of ~step's request and response for BipedalWalker-v3, with length fields and flags.
MESSAGE_SIZES = ("--request-bytes", 40, "--response-bytes", 300, "--spin-us", 50)
MIN_PERIOD = 0.5  # of the diagnostics, long enough for a few steps [s]
LOCKSTEP_ROSPY = pathlib.Path(__file__).with_name("lockstep_rospy.py")
# A shell in the background ignores SIGINT, and so would Python.
BUSY_PROGRAM = """
import signal
signal.signal(signal.SIGINT, signal.SIG_DFL)
while True:
    pass
"""
BUSY = (sys.executable, "-c", BUSY_PROGRAM)
JITTERS = (  # condition, number of busy processes, realtime_priority
    ("quiet", 0, 0),
    ("two busy processes", 2, 0),
    ("two busy processes, realtime_priority 50", 2, 50),
)


class Condition(NamedTuple):
    """What runs beside the server and its client."""

    arguments: Sequence[str] = ("rviz:=false", "status:=false")  # of walker.launch
    beside: Sequence[Sequence[str]] = ()  # commands
    topic: str = ""  # to which the condition's node subscribes


CONDITIONS = {
    "status line": Condition(["headless:=true"], topic="/odom"),
    "alone": Condition(),
    "rviz": Condition(["rviz:=true"], topic="/state_markers"),
    "rostopic hz joint_states": Condition(
        beside=[["rostopic", "hz", "/joint_states"]], topic="/joint_states"
    ),
    "rostopic hz transition": Condition(
        beside=[["rostopic", "hz", "/transition"]], topic="/transition"
    ),
    "rosbag record -a": Condition(beside=[["rosbag", "record", "-a"]], topic="/state_markers"),
    "one busy process": Condition(beside=[BUSY]),
    "two busy processes": Condition(beside=[BUSY, BUSY]),
}


def lockstep(settings):
    """One environment stepped by service in each condition, with no process bound to a core."""
    rows = []
    for env in (WALKER, WALKER2D):
        for name in list(CONDITIONS)[: 1 if settings.is_quick else None]:
            plan = lockstep_plan(settings, env, name)
            topic = CONDITIONS[name].topic
            try:
                # The folder is removed with the recorder's bag, which may exceed 1 GB.
                with TemporaryDirectory(dir=settings.folder) as folder, Master(settings) as master:
                    launch(settings, master, env, CONDITIONS[name], folder)
                    plan.run(settings.rounds(4))
                    if topic and not master.has_subscriber(topic):
                        raise Failure(f"the subscriber of {topic} ended during the measurement")
            except Failure as failure:
                for row in plan.rows:
                    row.error = str(failure)
            rows += plan.rows
    return rows


def lockstep_plan(settings, env, condition):
    plan = Plan("lockstep", "steps/s", steps_per_second, settings.folder)
    seconds = ["--seconds", settings.seconds(0.6)]
    server = ["--server", "/walker_sim", *seconds]

    def add(side, command):
        return plan.add(side, env, command, settings.two_cores, condition=condition)

    sides = [
        add("our client", [settings.programs / "walker_sim_benchmark", "client", *server]),
        add("gymnasium.make", settings.python("gymnasium", env, *server)),
    ]
    if env == WALKER:
        sides.append(add("roscpp", [settings.programs / "walker_sim_lockstep_roscpp", *server]))
        sides.append(add("rospy", [sys.executable, LOCKSTEP_ROSPY, *server]))
    gymnasium = add("Gymnasium in process", settings.peer("gymnasium", env, *seconds))
    for ours in sides:
        against(ours, gymnasium)
    return plan


def launch(settings, master, env, condition, folder):
    """Starts walker.launch and the processes of the condition, until the master ends."""
    run = functools.partial(master.process, cores=settings.two_cores, cwd=folder)
    variables = []
    if "rviz:=true" in condition.arguments:
        try:
            display = start_screen(run, "1360x860")
        except AssertionError as error:
            raise Failure(str(error)) from None
        # rviz stores its settings in HOME.
        variables = [f"DISPLAY={display}", "QT_QPA_PLATFORM=xcb", f"HOME={folder}"]
    arguments = [f"env:={env}", "mode:=lockstep", *condition.arguments]
    process = run(["env", *variables, "roslaunch", "walker_sim", "walker.launch", *arguments])
    master.await_service("/walker_sim/get_spec", process)
    for command in condition.beside:
        run(command)
    if condition.topic:
        is_there = functools.partial(master.has_subscriber, condition.topic)
        await_true(is_there, f"a subscriber of {condition.topic}")


def transport(settings):
    """A server without physics, beside a raw TCP connection with messages of the same size."""
    plan = Plan("transport", "steps/s", steps_per_second, settings.folder)
    seconds = ["--seconds", settings.seconds(0.6)]

    def add(side, program, *options):
        command = [settings.programs / program, *options, *seconds]
        return plan.add(side, WALKER, command, settings.two_cores)

    with Master(settings) as master:
        options = {"mode": "lockstep", "env": WALKER}
        name, _ = master.server("walker_sim_null_server", cores=settings.two_cores, **options)
        ours = add("our client, no physics", "walker_sim_benchmark", "client", "--server", name)
        against(ours, add("raw TCP", "walker_sim_ping_pong", *MESSAGE_SIZES))
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
        watch(settings, 2, {"real_time_factor": fastest}, env=env, real_time_factor=0)
    return rows


def jitter(settings):
    """Deviation of the intervals between steps in real time, with and without a priority."""
    rows = []
    for env in (WALKER, "Walker2d-v5"):
        for name, number_busy, priority in JITTERS[: 1 if settings.is_quick else None]:
            by_key = {
                f"jitter_{key}_us": Row("jitter", env, text, "us", condition=name)
                for key, text in (("p50", "p50"), ("p99", "p99"), ("p999", "p99.9"), ("max", "max"))
            }
            rows += by_key.values()
            watch(settings, 8, by_key, number_busy, env=env, realtime_priority=priority)
    return rows


def watch(settings, period, rows, number_busy=0, **parameters):
    """Appends the values of two reports to the rows, keyed by their names in the diagnostics. The
    first report of all covers the paused start-up: it has elapsed time but no intervals."""
    period = max(settings.seconds(period), MIN_PERIOD)
    parameters["diagnostic_period"] = period
    try:
        with Master(settings) as master:
            cores = settings.two_cores
            master.server(mode="free", paused="true", cores=cores, **parameters)
            master.process([settings.programs / "topic_agent", "_agent:=heuristic"], cores)
            call_service("/walker_sim/unpause")
            for _ in range(number_busy):
                master.process(BUSY, settings.two_cores)
            skipped = 1 if parameters.get("real_time_factor") == 0 else 0
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
