"""One slice of a peer or of this package's Python environments. Prints a line of JSON per size.

    peers.py envpool          --env ID --num-envs N[,N...] --threads K --seconds S
    peers.py envpool-async    --env ID --num-envs N[,N...] --threads K --seconds S
    peers.py envpool-reset    --env ID --seconds S
    peers.py envpool-memory   --env ID --num-envs N --steps M
    peers.py gymnasium        --env ID --seconds S [--server NAME]    gymnasium.make
    peers.py gymnasium-reset  --env ID --seconds S
    peers.py gymnasium-memory --env ID --num-envs N --steps M
    peers.py gymnasium-vector --env ID --num-envs N --seconds S       AsyncVectorEnv
    peers.py make_vec         --env ID --num-envs N --threads K --seconds S
    peers.py play_out         --env ID --num-envs N --threads K --seconds S   episodes

Actions are random float32 values, prepared in the type that the peer asks for. In vector
environments an ended episode is reset in place of its next step, which counts as a step; resets of
single environments take time and do not count.
"""

import argparse
import ctypes
import itertools
import json
import os
import pathlib

import gymnasium as gym
from walker_sim import _core
from walker_sim.commands import bench
from walker_sim.commands.policies import shipped_policy
from walker_sim.episode_player import make_player, play_jobs
from walker_sim.registration import without_namespace

WARM_UP = 0.25  # fraction of the slice
RESETS = 16  # environments that envpool-reset resets per call, for less overhead per reset

gym.logger.min_level = gym.logger.ERROR  # no warning that v4 is outdated


def measure(seconds, step):
    """Measures after an uncounted warm-up, like program.h."""
    bench.measure(WARM_UP * seconds, step)
    return bench.measure(seconds, step)._asdict()


def counting(count, call):
    """Returns a function that calls `call` and returns `count`."""

    def step():
        call()
        return count

    return step


def make_envpool(env, num_envs, threads=1, **options):
    """Does not bind threads to cores: that is no faster and ignores this process's CPU affinity."""
    import envpool

    return envpool.make(
        env, env_type="gymnasium", num_envs=num_envs, num_threads=threads, seed=0, **options
    )


# The measurements. Each takes the options and the number of environments; returns a line.


def gymnasium(options, _):
    remote = {"transport": "ros", "server": options.server} if options.server else {}
    return measure(options.seconds, bench.single(options.env, **remote))


def make_vec(options, num_envs):
    step = bench.vector(options.env, num_envs, num_threads=options.threads)
    return measure(options.seconds, counting(num_envs, step))


def play_out(options, count):
    env_id = without_namespace(options.env)
    player = make_player(env_id, {}, options.threads)
    policy = _core.Policy(str(shipped_policy(env_id)))
    seeds = itertools.count()

    def step():
        jobs = [(0, seed, 0) for seed in itertools.islice(seeds, count)]
        return sum(episode.length for episode in play_jobs(player, [policy], [], jobs))

    return measure(options.seconds, step)


def gymnasium_vector(options, num_envs):
    step = bench.vector(options.env, num_envs, vectorization_mode="async")
    return measure(options.seconds, counting(num_envs, step))


def envpool(options, num_envs):
    env = make_envpool(options.env, num_envs, options.threads)
    actions = bench.random_actions(env.action_space, num_envs)
    env.reset()
    return measure(options.seconds, counting(num_envs, lambda: env.step(next(actions))))


def envpool_async(options, num_envs):
    batch = (num_envs + 1) // 2
    env = make_envpool(options.env, num_envs, options.threads, batch_size=batch)
    actions = bench.random_actions(env.action_space, batch)
    env.async_reset()
    step = counting(batch, lambda: env.send(next(actions), env.recv()[-1]["env_id"]))
    return measure(options.seconds, step)


def gymnasium_reset(options, _):
    env = gym.make(options.env)
    env.reset(seed=0)
    return measure(options.seconds, counting(1, env.reset))


def envpool_reset(options, _):
    return measure(options.seconds, counting(RESETS, make_envpool(options.env, RESETS).reset))


def resident_bytes():
    """Returns this process's resident memory after freed memory was returned to the system."""
    ctypes.CDLL(None).malloc_trim(0)
    pages = int(pathlib.Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGESIZE")


def gymnasium_memory(options, num_envs):
    def make():
        env = gym.make(options.env)
        env.reset(seed=0)
        return env

    first = make()
    actions = bench.random_actions(first.action_space)
    first.step(next(actions))
    before = resident_bytes()
    envs = [make() for _ in range(num_envs)]
    for _ in range(options.steps):
        for env in envs:
            _, _, terminated, truncated, _ = env.step(next(actions))
            if terminated or truncated:
                env.reset()
    return {"bytes_per_environment": (resident_bytes() - before) / num_envs}


def envpool_memory(options, num_envs):
    first = make_envpool(options.env, 1)
    actions = bench.random_actions(first.action_space, num_envs)
    first.reset()
    first.step(next(actions)[:1])
    before = resident_bytes()
    env = make_envpool(options.env, num_envs)
    env.reset()
    for _ in range(options.steps):
        env.step(next(actions))
    return {"bytes_per_environment": (resident_bytes() - before) / num_envs}


KINDS = {
    "envpool": envpool,
    "envpool-async": envpool_async,
    "envpool-reset": envpool_reset,
    "envpool-memory": envpool_memory,
    "gymnasium": gymnasium,
    "gymnasium-reset": gymnasium_reset,
    "gymnasium-memory": gymnasium_memory,
    "gymnasium-vector": gymnasium_vector,
    "make_vec": make_vec,
    "play_out": play_out,
}


def parse_counts(text):
    return [int(count) for count in text.split(",")]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("--env", required=True)
    parser.add_argument("--num-envs", type=parse_counts, default=[1])
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=1)
    parser.add_argument("--steps", type=int, default=100)
    parser.add_argument("--server")
    options = parser.parse_args()
    for num_envs in options.num_envs:
        line = KINDS[options.kind](options, num_envs)
        print(json.dumps({"num_envs": num_envs, **line}), flush=True)


if __name__ == "__main__":
    main()
