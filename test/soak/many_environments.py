"""1024 environments on one server, stepped together."""

import gymnasium
import numpy as np
import usage
import walker_sim  # noqa: F401  # registers the ids
from launched import processor_time

NUM_ENVS = 1024
ENV = "walker_sim/BipedalWalker-v3"
EPISODE = 100  # steps; then most environments reset together and heaps peak
# The heaps of this many walkers fluctuate by some MiB. A leak of 16 bytes per step and walker takes
# 16 MiB in 1000 steps of all.
MAX_GROWTH = usage.MAX_GROWTH + NUM_ENVS * usage.PAGE
TIMEOUT = 600.0  # client's timeout [s]; all other parts have priority


def run(soak):
    with soak.graph() as graph:
        server = graph.server(num_envs=NUM_ENVS, max_episode_steps=EPISODE)
        place = {"transport": "ros", "server": server.name, "master_uri": graph.uri}
        own = {"max_episode_steps": EPISODE}
        remote = gymnasium.make_vec(ENV, NUM_ENVS, timeout=TIMEOUT, **place, **own)
        local = gymnasium.make_vec(ENV, NUM_ENVS, **own)
        equal = same(remote.reset(seed=1), local.reset(seed=1))
        random = np.random.default_rng(soak.random.randrange(1 << 32))
        watched, latency, steps = usage.Usage(server.pid), usage.Latency(), 0
        before, spent = usage.now(server.pid), [processor_time(server.pid)]
        soak.begin()
        while steps == 0 or soak.goes_on():
            actions = random.uniform(-1, 1, remote.action_space.shape).astype(np.float32)
            with latency:
                theirs = remote.step(actions)
            equal = same(theirs, local.step(actions)) and equal
            spent.append(processor_time(server.pid))
            watched.sample()
            steps += 1
        soak.check(f"{NUM_ENVS} environments have the bits of those in process", equal)
        work = f"{steps:,} steps of {NUM_ENVS} environments"
        watched.check(soak.tally, "the server", work, MAX_GROWTH)
        latency.check(soak.tally, f"a step of {NUM_ENVS} over ROS", is_alone=False)
        if watched.is_long_enough():
            check_work(soak, spent)
        remote.close()
        local.close()
        soak.check("threads stay the same", usage.now(server.pid)[2] == before[2])


def check_work(soak, spent):
    """Checks the processor time of a step, on which other load has little influence.

    Parameters
    ----------
    spent
        Processor time of the server before the first step and after each step [s].
    """
    fifth = max(1, len(spent) // 5)
    first, last = (
        (part[-1] - part[0]) / fifth for part in (spent[: fifth + 1], spent[-fifth - 1 :])
    )
    figures = f"{first * 1e3:.1f}; {last * 1e3:.1f}"
    soak.check("the work of a step stays below twice the first", last < 2 * first, figures)
    soak.figure(f"processor time of a step of {NUM_ENVS} at first; at last [ms]", figures)


def same(one, other):
    return all(a.tobytes() == b.tobytes() for a, b in zip(one[:-1], other[:-1]))
