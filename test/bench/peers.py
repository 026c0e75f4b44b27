"""One slice of a peer: EnvPool or Gymnasium, in this process. Prints lines of JSON.

    peers.py envpool        --env ID --num-envs N[,N...] --threads K --seconds S
    peers.py envpool-async  --env ID --num-envs N[,N...] --threads K --seconds S
    peers.py envpool-reset  --env ID --seconds S
    peers.py envpool-memory --env ID --num-envs N --steps M
    peers.py gymnasium ...           a single environment, as are -lockstep, -reset and -memory
    peers.py gymnasium-vector ...    AsyncVectorEnv: a process for each environment

Random actions with float32 values, prepared beforehand in the type that the peer asks for. EnvPool
resets an episode that has ended in place of its next step, and so does the loop around Gymnasium.
"""

import argparse
import ctypes
import itertools
import json
import os
import pathlib
import time

import numpy

VALUES = 32768  # number of prepared action values, at least one row
WARM_UP = 0.25  # fraction of the slice


def prepared(space, *shape):
    rows = max(VALUES // (int(numpy.prod(shape)) * space.shape[0]), 1)
    random = numpy.random.default_rng(0).uniform(-1, 1, (rows, *shape, *space.shape))
    return itertools.cycle(random.astype(numpy.float32).astype(space.dtype))


def measure(seconds, count_a_call, call):
    """Calls for `seconds` after an uncounted warm-up, like slice.h."""
    for duration in (WARM_UP * seconds, seconds):
        steps = 0
        processor, begin = time.process_time(), time.perf_counter()
        while True:
            call()
            steps += count_a_call
            wall = time.perf_counter() - begin
            if wall >= duration:
                break
        processor = time.process_time() - processor
    return {"steps": steps, "seconds": wall, "processor_seconds": processor}


class Gymnasium:
    def __init__(self, env, actions=None, **options):
        import gymnasium

        gymnasium.logger.min_level = gymnasium.logger.ERROR  # no warning that v4 is outdated
        self.env = gymnasium.make(env, **options)
        self.actions = actions or prepared(self.env.action_space)
        self.env.reset(seed=0)
        self.has_ended = False

    def step_or_reset(self):
        if self.has_ended:
            self.env.reset()
            self.has_ended = False
        else:
            self.step()

    def step_and_reset(self):
        self.step()
        if self.has_ended:
            self.env.reset()

    def step(self):
        _, _, terminated, truncated, _ = self.env.step(next(self.actions))
        self.has_ended = terminated or truncated


def make_envpool(env, num_envs, threads=1, **options):
    """Does not bind threads to cores: that is no faster and ignores this process's CPU affinity."""
    import envpool

    return envpool.make(
        env, env_type="gymnasium", num_envs=num_envs, num_threads=threads, seed=0, **options
    )


# The measurements. Each takes the options and the number of environments; returns a line.


def gymnasium(options, _):
    return measure(options.seconds, 1, Gymnasium(options.env).step_or_reset)


def gymnasium_lockstep(options, _):
    """As a server's client does: resets take time but are not counted as steps."""
    return measure(options.seconds, 1, Gymnasium(options.env).step_and_reset)


def gymnasium_vector(options, num_envs):
    import gymnasium

    gymnasium.logger.min_level = gymnasium.logger.ERROR
    envs = gymnasium.make_vec(options.env, num_envs, vectorization_mode="async")
    actions = prepared(envs.single_action_space, num_envs)
    envs.reset(seed=0)
    slice_ = measure(options.seconds, num_envs, lambda: envs.step(next(actions)))
    envs.close()
    return slice_


def envpool(options, num_envs):
    env = make_envpool(options.env, num_envs, options.threads)
    actions = prepared(env.action_space, num_envs)
    env.reset()
    return measure(options.seconds, num_envs, lambda: env.step(next(actions)))


def envpool_async(options, num_envs):
    batch = (num_envs + 1) // 2
    env = make_envpool(options.env, num_envs, options.threads, batch_size=batch)
    actions = prepared(env.action_space, batch)
    env.async_reset()
    return measure(
        options.seconds, batch, lambda: env.send(next(actions), env.recv()[-1]["env_id"])
    )


def gymnasium_reset(options, _):
    return measure(options.seconds, 1, Gymnasium(options.env).env.reset)


def envpool_reset(options, _):
    """Resets 16 environments per call to reduce Python's overhead per reset."""
    at_a_time = 16
    return measure(options.seconds, at_a_time, make_envpool(options.env, at_a_time).reset)


def resident_bytes():
    """Returns this process's resident memory after freed memory was returned to the system."""
    ctypes.CDLL(None).malloc_trim(0)
    pages = int(pathlib.Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGESIZE")


def gymnasium_memory(options, num_envs):
    first = Gymnasium(options.env)
    first.step_or_reset()
    before = resident_bytes()
    singles = [Gymnasium(options.env, first.actions) for _ in range(num_envs)]
    for _ in range(options.steps):
        for single in singles:
            single.step_or_reset()
    return {"bytes_per_environment": (resident_bytes() - before) / num_envs}


def envpool_memory(options, num_envs):
    first = make_envpool(options.env, 1)
    actions = prepared(first.action_space, num_envs)
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
    "gymnasium-lockstep": gymnasium_lockstep,
    "gymnasium-vector": gymnasium_vector,
    "gymnasium-reset": gymnasium_reset,
    "gymnasium-memory": gymnasium_memory,
}


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("--env", required=True)
    parser.add_argument(
        "--num-envs", type=lambda text: [int(count) for count in text.split(",")], default=[1]
    )
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=1)
    parser.add_argument("--steps", type=int, default=100)
    options = parser.parse_args()
    for num_envs in options.num_envs:
        line = KINDS[options.kind](options, num_envs)
        print(json.dumps({"num_envs": num_envs, **line}), flush=True)


if __name__ == "__main__":
    main()
