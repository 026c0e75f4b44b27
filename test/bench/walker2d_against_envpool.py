"""Walker2d's speed and size beside EnvPool's and Gymnasium's, on one core, in one run.

    ./scripts/env pip install -r test/bench/requirements.txt
    ./scripts/env python test/bench/walker2d_against_envpool.py

Speeds are steps per second of processor time, which other work on the machine disturbs least; the
sides take turns, each slice in a fresh process, and medians are compared. On an idle machine the
same comes out by the wall clock, which is shown beside. Everywhere the actions are random and
prepared beforehand, and an episode that has ended is reset in place of its next step.
"""

import argparse
import importlib.metadata
import importlib.util
import json
import multiprocessing
import os
import pathlib
import statistics
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
BENCHMARK = ROOT / "build/pinned/devel/lib/walker_sim/walker_sim_walker2d_benchmark"
PEERS = ("envpool", "gymnasium", "mujoco")
ID = "Walker2d-v4"  # the peers'; ours are v4 and v5
ENVIRONMENTS = 16
ACTIONS = 8192
WARM_UP_SECONDS = 0.5
LEAST_RATIO = 1.5
MOST_KILOBYTES = 160
MOST_MICROSECONDS = 10


def random_actions(*shape):
    import numpy

    return numpy.random.default_rng(0).uniform(-1, 1, (*shape, 6)).astype(numpy.float32)


def measure_rate(step, steps_a_call, seconds):
    """Steps per second of processor time and of wall time, after a warm-up."""
    for duration in (WARM_UP_SECONDS, seconds):
        count = 0
        wall, processor = time.perf_counter(), time.process_time()
        while time.perf_counter() - wall < duration:
            step()
            count += steps_a_call
        processor, wall = time.process_time() - processor, time.perf_counter() - wall
    return count / processor, count / wall


def make_envpool(count):
    import envpool

    return envpool.make(ID, env_type="gymnasium", num_envs=count, num_threads=1)


def speed_of_envpool(seconds):
    env = make_envpool(ENVIRONMENTS)
    actions = Cycle(random_actions(ACTIONS // ENVIRONMENTS, ENVIRONMENTS))
    env.reset()
    return measure_rate(lambda: env.step(actions.next()), ENVIRONMENTS, seconds)


def speed_of_gymnasium(seconds):
    env = GymnasiumStepper(Cycle(random_actions(ACTIONS)))
    return measure_rate(env.step, 1, seconds)


class Cycle:
    def __init__(self, rows):
        self.rows, self.index = rows, -1

    def next(self):
        self.index = (self.index + 1) % len(self.rows)
        return self.rows[self.index]


class GymnasiumStepper:
    """A single environment that resets itself in place of the step after an episode's end."""

    def __init__(self, actions):
        import gymnasium

        gymnasium.logger.min_level = gymnasium.logger.ERROR  # v4 is not the newest; we know
        self.env, self.actions, self.has_ended = gymnasium.make(ID), actions, True

    def step(self):
        if self.has_ended:
            self.env.reset()
            self.has_ended = False
        else:
            _, _, terminated, truncated, _ = self.env.step(self.actions.next())
            self.has_ended = terminated or truncated


def resident_kilobytes():
    pages = int(pathlib.Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGESIZE") / 1000


def memory_of_envpool(count, steps):
    """kB of an environment, once the library and what all share are loaded."""
    first = make_envpool(1)
    actions = random_actions(steps, count)
    first.reset()
    first.step(actions[0, :1])
    before = resident_kilobytes()
    env = make_envpool(count)
    env.reset()
    for action in actions:
        env.step(action)
    return (resident_kilobytes() - before) / count


def memory_of_gymnasium(count, steps):
    actions = Cycle(random_actions(ACTIONS))
    first = GymnasiumStepper(actions)
    first.step()
    before = resident_kilobytes()
    envs = [GymnasiumStepper(actions) for _ in range(count)]
    for _ in range(steps):
        for env in envs:
            env.step()
    return (resident_kilobytes() - before) / count


def in_child(function, *arguments):
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(function, arguments)


def run_benchmark(executable, name, seconds=1.0):
    """google-benchmark's numbers of one benchmark of ours."""
    command = [executable, f"--benchmark_filter=^{name}(/iterations:1)?$"]
    command += [f"--benchmark_min_time={seconds}", "--benchmark_format=json"]
    output = subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout
    return json.loads(output)["benchmarks"][0]


def speed_of_ours(executable, version, seconds):
    numbers = run_benchmark(executable, f"step/{version}", seconds)
    rate = numbers["items_per_second"]
    return rate, rate * numbers["cpu_time"] / numbers["real_time"]


def compare_speed(executable, rounds, seconds):
    """Prints the table; returns how many times as fast as EnvPool our v4 and v5 are."""
    sides = {
        "walker_sim v4": lambda: speed_of_ours(executable, "v4", seconds),
        "EnvPool v4": lambda: in_child(speed_of_envpool, seconds),
        "walker_sim v5": lambda: speed_of_ours(executable, "v5", seconds),
        "Gymnasium v4": lambda: in_child(speed_of_gymnasium, seconds),
    }
    speeds = {name: [] for name in sides}
    for _ in range(rounds):
        for name, measure in sides.items():
            speeds[name].append(measure())
    medians = {
        name: [statistics.median(column) for column in zip(*rows)] for name, rows in speeds.items()
    }
    peer = medians["EnvPool v4"]
    print(f"{'':14}{'steps/s':>9}{'least':>9}{'most':>9}{'ratio':>7}{'wall clock':>13}{'ratio':>7}")
    for name, (rate, wall) in medians.items():
        least, *_, most = sorted(rate for rate, _ in speeds[name])
        print(
            f"{name:14}{rate:9.0f}{least:9.0f}{most:9.0f}{rate / peer[0]:7.2f}"
            f"{wall:13.0f}{wall / peer[1]:7.2f}"
        )
    return [medians[f"walker_sim {version}"][0] / peer[0] for version in ("v4", "v5")]


def compare_memory(executable):
    """Prints the table; returns kB per environment of our v4 and v5."""
    ours = [
        run_benchmark(executable, f"memory/{version}")["kB_per_environment"]
        for version in ("v4", "v5")
    ]
    envpool = in_child(memory_of_envpool, 1000, 100)
    gymnasium = in_child(memory_of_gymnasium, 100, 100)
    names = ("walker_sim v4", "walker_sim v5", "EnvPool v4", "Gymnasium v4")
    print("\nResident memory per environment")
    for name, kilobytes in zip(names, (*ours, envpool, gymnasium)):
        print(f"{name:14}{kilobytes:9.0f} kB")
    return ours


def judge(executable, ratios, kilobytes):
    """Prints what became of each target; returns whether all are reached."""
    print("\nTargets")
    all_reached = True
    for version, ratio, size in zip(("v4", "v5"), ratios, kilobytes):
        reset = run_benchmark(executable, f"reset/{version}")["cpu_time"]
        for what, value, limit, reached in (
            ("speed, EnvPool v4 = 1", ratio, f"at least {LEAST_RATIO}", ratio >= LEAST_RATIO),
            ("memory, kB", size, f"at most {MOST_KILOBYTES}", size <= MOST_KILOBYTES),
            ("reset, us", reset, f"below {MOST_MICROSECONDS}", reset < MOST_MICROSECONDS),
        ):
            verdict = "reached" if reached else "NOT REACHED"
            print(f"{version} {what:22}{value:8.2f}   {limit:14}{verdict}")
            all_reached = all_reached and reached
    return all_reached


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--benchmark", type=pathlib.Path, default=BENCHMARK, metavar="EXECUTABLE")
    parser.add_argument("--rounds", type=int, default=6)
    parser.add_argument("--seconds", type=float, default=3, help="of each slice")
    arguments = parser.parse_args()
    if arguments.rounds < 2:
        parser.error(f"--rounds {arguments.rounds}: must be at least 2")
    if not arguments.seconds > 0:
        parser.error(f"--seconds {arguments.seconds:g}: must be above 0")
    arguments.benchmark = arguments.benchmark.resolve()
    if not arguments.benchmark.exists():
        parser.error(
            f"{arguments.benchmark} does not exist; it is built with the tests where "
            "google-benchmark (libbenchmark-dev) is installed"
        )
    for package in PEERS:
        if importlib.util.find_spec(package) is None:
            parser.error(
                f"{package} is not installed: "
                "./scripts/env pip install -r test/bench/requirements.txt"
            )
    return arguments


def main():
    arguments = parse_arguments()
    core = max(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {core})  # for the children too
    os.chdir(arguments.benchmark.parent)  # where MuJoCo would leave its log
    print("Walker2d beside", ", ".join(f"{p} {importlib.metadata.version(p)}" for p in PEERS))
    print(
        f"Core {core}, load average {os.getloadavg()[0]:.1f}; {arguments.rounds} rounds, slices of "
        f"{arguments.seconds:g} s\n"
    )
    ratios = compare_speed(arguments.benchmark, arguments.rounds, arguments.seconds)
    kilobytes = compare_memory(arguments.benchmark)
    return 0 if judge(arguments.benchmark, ratios, kilobytes) else 1


if __name__ == "__main__":
    sys.exit(main())
