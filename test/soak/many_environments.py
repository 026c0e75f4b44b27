"""1024 environments on one server, stepped together."""

import gymnasium
import numpy as np
import usage
import walker_sim  # noqa: F401  # registers the ids

NUM_ENVS = 1024
ENV = "walker_sim/BipedalWalker-v3"
PATIENCE = 600.0  # of a step, where all others have precedence [s]


def run(soak):
    with soak.graph() as graph:
        server = graph.server(num_envs=NUM_ENVS)
        options = {"transport": "ros", "server": server.name, "master_uri": graph.uri}
        remote = gymnasium.make_vec(ENV, NUM_ENVS, timeout=PATIENCE, **options)
        local = gymnasium.make_vec(ENV, NUM_ENVS)
        equal = same(remote.reset(seed=1), local.reset(seed=1))
        random = np.random.default_rng(soak.random.randrange(1 << 32))
        watched, latency, steps = usage.Usage(server.pid), usage.Latency(), 0
        before = usage.now(server.pid)
        soak.begin()
        while steps == 0 or soak.goes_on():
            actions = random.uniform(-1, 1, remote.action_space.shape).astype(np.float32)
            with latency:
                theirs = remote.step(actions)
            equal = same(theirs, local.step(actions)) and equal
            watched.sample()
            steps += 1
        soak.check(f"{NUM_ENVS} environments have the bits of those in process", equal)
        watched.judge(soak.tally, "the server", f"{steps:,} steps of {NUM_ENVS} environments")
        latency.judge(soak.tally, f"a step of {NUM_ENVS} over ROS")
        remote.close()
        local.close()
        soak.check("threads stay the same", usage.now(server.pid)[2] == before[2])


def same(one, other):
    """Observations, and of a step rewards and flags."""
    return all(a.tobytes() == b.tobytes() for a, b in zip(one[:-1], other[:-1]))
