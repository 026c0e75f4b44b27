"""Several clients of one server: calls are serialised and atomic, and none is lost."""

import contextlib
import signal
import threading
import time

from graph import PROMPT, await_true
from std_srvs.srv import Trigger
from walker_sim.srv import (
    GetSpec,
    Render,
    Reset,
    ResetBatch,
    Restore,
    Snapshot,
    Step,
    StepBatch,
    StepMany,
)

DT = 20_000_000  # [ns]
STAND = [1.0, 1.0, -1.0, 1.0]  # the walker stands astride for thousands of steps
CLIENTS, CALLS = 8, 40


def run(soak):
    with soak.graph() as graph:
        for number in soak.rounds():
            serialise(soak, graph)
            step_while_others_pause(soak, graph)
            end_amid(soak, graph, number)


def together(*calls):
    """Runs each call in its own thread and raises what a call raises."""
    errors = []

    def guarded(call):
        try:
            call()
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=guarded, args=(call,), daemon=True) for call in calls]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if errors:
        raise errors[0]


def serialise(soak, graph):
    """All steps and resets make one history, which keeps each client's order."""
    server = graph.server(max_episode_steps=0)
    first = graph.client(f"{server.name}/reset", Reset)
    histories = [[first(has_seed=True, seed=1).transition]]

    def step_on(history, resets):
        step = graph.client(f"{server.name}/step", Step)
        reset = graph.client(f"{server.name}/reset", Reset)
        for call in range(CALLS):
            if resets and call % 10 == 9:
                history.append(reset(has_seed=True, seed=call).transition)
            else:
                history.append(step(action=STAND).transition)
        step.close()
        reset.close()

    calls = []
    for index in range(CLIENTS):
        histories.append([])
        calls.append(lambda h=histories[-1], r=index < 2: step_on(h, r))
    together(*calls)
    stamps = [[t.header.stamp.to_nsec() for t in history] for history in histories]
    rising = all(a < b for own in stamps for a, b in zip(own, own[1:]))
    soak.check("each client's calls are made in its order", rising)
    told = sorted((t for history in histories for t in history), key=lambda t: t.header.stamp)
    pairs = list(zip(told, told[1:]))
    soak.check(
        "all calls of all clients make one history without a gap",
        all(b.header.stamp.to_nsec() - a.header.stamp.to_nsec() == DT for a, b in pairs)
        and all(
            (b.episode, b.step) in ((a.episode, a.step + 1), (a.episode + 1, 0)) for a, b in pairs
        ),
    )
    soak.check("no call is lost", len(told) == 1 + CLIENTS * CALLS, f"{len(told)}")
    server.end()


def step_while_others_pause(soak, graph):
    """A free-running server steps for a client only while it is paused, and otherwise refuses."""
    server = graph.server(mode="free", real_time_factor=1)
    outcomes, over = [], threading.Event()

    def pause_on():
        calls = [graph.client(f"{server.name}/{name}", Trigger) for name in ("pause", "unpause")]
        for _ in range(20):
            for call in calls:
                soak.check("pause and unpause are obeyed amid steps", call().success)
                time.sleep(soak.random.uniform(0, 0.003))
        over.set()

    def step_on():
        step = graph.client(f"{server.name}/step", Step)
        while not over.is_set():
            reply = step(action=STAND)
            outcomes.append(reply.success or "call ~pause first" in reply.status_message)

    together(pause_on, step_on)
    refusals = [bool(outcome) for outcome in outcomes]
    soak.check("a step is made or refused with the reason", all(refusals), refusals.count(False))
    server.end()


def end_amid(soak, graph, number):
    num_envs = 1 if number % 2 == 0 else 4
    server = graph.server(num_envs=num_envs)
    if num_envs == 1:
        record = prepare_record(graph, server)
        wanted = {
            "reset": (Reset, {}),
            "step_many": (StepMany, {"action": STAND, "steps": 100}),
            "snapshot": (Snapshot, {}),
            "restore": (Restore, {"record": record}),
            "render": (Render, {}),
        }
    else:
        wanted = {
            "reset_batch": (ResetBatch, {}),
            "step_batch": (StepBatch, {"actions": STAND * num_envs}),
            "get_spec": (GetSpec, {}),
            "render": (Render, {"environment": 1}),
        }
    answers = dict.fromkeys(wanted, 0)

    def call_on(name):
        service_class, fields = wanted[name]
        client = graph.client(f"{server.name}/{name}", service_class)
        with contextlib.suppress(OSError):  # the server has ended
            while True:
                client(**fields)
                answers[name] += 1

    ends = []

    def end():
        try:
            await_true(lambda: all(answers.values()), "an answer to a call of each kind", PROMPT)
            time.sleep(soak.random.uniform(0, 0.1))
        finally:
            ends.append(server.end(soak.random.choice([signal.SIGINT, signal.SIGTERM])))

    together(end, *[lambda name=name: call_on(name) for name in wanted])
    soak.check(
        f"told to end amid calls, the server does within {PROMPT} s",
        ends == [0],
        f"status {ends}: {server.output()}",
    )
    soak.check("until then it answers calls of each kind", all(answers.values()), answers)


def prepare_record(graph, server):
    graph.client(f"{server.name}/reset", Reset)(has_seed=True, seed=3)
    graph.client(f"{server.name}/step_many", StepMany)(action=STAND, steps=100)
    return graph.client(f"{server.name}/snapshot", Snapshot)().record
