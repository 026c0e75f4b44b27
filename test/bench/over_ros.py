"""Measurements over ROS: lock-step, batches, free-running mode, start-up."""

import contextlib
import functools
import pathlib
import signal
import subprocess
import sys
import time
import xmlrpc.client
from tempfile import TemporaryDirectory
from typing import NamedTuple, Sequence

import yaml
from measure import Failure, Plan, Row, against, run_slice, steps_per_second
from processes import STARTUP_TIMEOUT, Master, start_screen, wait_for

WALKER, WALKER2D = "BipedalWalker-v3", "Walker2d-v4"
BATCHES = (1, 8, 64, 512)
# Sizes of ~step's request and response for BipedalWalker-v3, with length fields and flags.
MESSAGE_SIZES = ("--request-bytes", 40, "--response-bytes", 300, "--spin-us", 50)
MIN_PERIOD = 0.5  # of the diagnostics, long enough for a few steps [s]
LOCKSTEP_ROSPY = pathlib.Path(__file__).with_name("lockstep_rospy.py")
BUSY = (sys.executable, "-c", "while True: pass")
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


def start_master(settings):
    """Starts a master whose processes are in sessions of their own, as from other terminals: Linux
    divides the processor among sessions."""
    options = {"exports": True, "command": ["roscore"], "start_new_session": True}
    return Master(settings.programs, **options)


def has_subscriber(master, topic):
    """Whether a node subscribes to the topic and still runs."""
    _, subscribers, _ = master.ask("getSystemState") or ((), (), ())
    for uri in filter(None, map(master.node_uri, dict(subscribers).get(topic, ()))):
        with contextlib.suppress(OSError):
            if xmlrpc.client.ServerProxy(uri).getPid("/bench")[0] == 1:
                return True
    return False


def diagnostics(count, period):
    """Returns the next messages on /diagnostics, each as one dict of all its values."""
    command = ["rostopic", "echo", "-n", str(count), "/diagnostics"]
    timeout = count * period + STARTUP_TIMEOUT
    done = subprocess.run(command, stdout=subprocess.PIPE, encoding="utf-8", timeout=timeout)
    reports = [document for document in yaml.safe_load_all(done.stdout) if document]
    if len(reports) != count:
        raise Failure(f"{len(reports)} reports on /diagnostics; must be {count}")
    return [
        {pair["key"]: pair["value"] for status in report["status"] for pair in status["values"]}
        for report in reports
    ]


def lockstep(settings):
    """One environment stepped by service in each condition, with no process bound to a core."""
    rows = []
    for env in (WALKER, WALKER2D):
        for name in list(CONDITIONS)[: 1 if settings.is_quick else None]:
            plan = lockstep_plan(settings, env, name)
            topic = CONDITIONS[name].topic
            try:
                # The folder is removed with the recorder's bag, which may exceed 1 GB.
                folder = TemporaryDirectory(dir=settings.folder)
                with folder as path, start_master(settings) as master:
                    launch(settings, master, env, CONDITIONS[name], path)
                    plan.run(settings.rounds(4))
                    if topic and not has_subscriber(master, topic):
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
    run = functools.partial(master.start, cores=settings.two_cores, cwd=folder)
    variables = []
    if "rviz:=true" in condition.arguments:
        display = start_screen(run, "1360x860")
        # rviz stores its settings in HOME.
        variables = [f"DISPLAY={display}", "QT_QPA_PLATFORM=xcb", f"HOME={folder}"]
    arguments = [f"env:={env}", "mode:=lockstep", *condition.arguments]
    process = run(["env", *variables, "roslaunch", "walker_sim", "walker.launch", *arguments])
    master.await_service("/walker_sim/get_spec", process)
    for command in condition.beside:
        run(command)
    if condition.topic:
        what = f"a subscriber of {condition.topic}"
        wait_for(lambda: has_subscriber(master, condition.topic), what, STARTUP_TIMEOUT)


def transport(settings):
    """A server without physics, beside a raw TCP connection with messages of the same size."""
    plan = Plan("transport", "steps/s", steps_per_second, settings.folder)
    seconds = ["--seconds", settings.seconds(0.6)]

    def add(side, program, *options):
        command = [settings.programs / program, *options, *seconds]
        return plan.add(side, WALKER, command, settings.two_cores)

    with start_master(settings) as master:
        null_server = "walker_sim_null_server"
        server = master.server(program=null_server, cores=settings.two_cores, env=WALKER)
        client = ["walker_sim_benchmark", "client", "--server", server.name]
        ours = add("our client, no physics", *client)
        against(ours, add("raw TCP", "walker_sim_ping_pong", *MESSAGE_SIZES))
        return plan.run(settings.rounds(4))


def step_batch(settings):
    plan = Plan("step_batch", "steps/s", steps_per_second, settings.folder)
    cores = settings.two_cores
    threads = {"threads": len(cores)}
    seconds = ["--seconds", settings.seconds(0.4)]
    with start_master(settings) as master:
        batches = {}
        for size in BATCHES:
            server = master.server(
                namespace=f"/batch_{size}",
                env=WALKER,
                num_envs=size,
                num_threads=len(cores),
                publish_clock=str(size == BATCHES[0]).lower(),
            )
            command = [settings.programs / "walker_sim_benchmark", "batch"]
            command += ["--server", server.name, *seconds]
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
        with start_master(settings) as master:
            cores = settings.two_cores
            master.server(mode="free", paused="true", cores=cores, **parameters)
            master.start([settings.programs / "topic_agent", "_agent:=heuristic"], cores)
            unpause = ["rosservice", "call", "/walker_sim/unpause"]
            subprocess.run(unpause, check=True, stdout=subprocess.DEVNULL, timeout=STARTUP_TIMEOUT)
            for _ in range(number_busy):
                master.start(BUSY, settings.two_cores)
            skipped = 1 if parameters.get("real_time_factor") == 0 else 0
            for report in diagnostics(2 + skipped, period)[skipped:]:
                for key, row in rows.items():
                    row.values.append(float(report[key]))
    except (Failure, KeyError, ValueError, subprocess.SubprocessError) as failure:
        for row in rows.values():
            row.error = f"{type(failure).__name__}: {failure}"


def start(settings):
    """Time from the start of roslaunch, with a running master, to the first answered step."""
    rows = []
    for env in (WALKER, "Walker2d-v5"):
        row = Row("start", env, "roslaunch", "s")
        rows.append(row)
        try:
            with start_master(settings) as master:
                for _ in range(settings.rounds(3)):
                    row.values.append(seconds_to_the_first_step(settings, master, env))
        except Failure as failure:
            row.error = str(failure)
    return rows


def seconds_to_the_first_step(settings, master, env):
    service = "/walker_sim/step_batch"
    arguments = [f"env:={env}", "mode:=lockstep", "rviz:=false", "status:=false"]
    begin = time.perf_counter()
    process = master.start(["roslaunch", "walker_sim", "walker.launch", *arguments])
    try:
        master.await_service(service, process)
        command = [settings.programs / "walker_sim_benchmark", "batch", "--server", "/walker_sim"]
        command += ["--seconds", "1e-6"]
        run_slice(command, settings.two_cores, settings.folder)
        seconds = time.perf_counter() - begin
    finally:
        process.end(signal.SIGINT, STARTUP_TIMEOUT)
    wait_for(lambda: not master.service_uri(service), f"the end of {service}", STARTUP_TIMEOUT)
    return seconds
