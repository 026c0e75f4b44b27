"""Repeated resets: constant memory and correct bits."""

import time

import gymnasium
import numpy as np
import usage
import walker_sim  # noqa: F401  # registers the ids

NUM_ENVS = 64
IDS = ("BipedalWalker-v3", "BipedalWalkerHardcore-v3", "Walker2d-v5", "Hopper-v5")


def run(soak):
    resets = 0
    for env_id in IDS:
        resets += reset_often(soak, env_id, soak.seconds / len(IDS))
    soak.figure("resets", f"{resets:,}")


def reset_often(soak, env_id, seconds):
    with soak.graph() as graph:
        server = graph.server(env=env_id, num_envs=NUM_ENVS)
        options = {"transport": "ros", "server": server.name, "master_uri": graph.uri}
        remote = gymnasium.make_vec(f"walker_sim/{env_id}", NUM_ENVS, timeout=60.0, **options)
        local = gymnasium.make_vec(f"walker_sim/{env_id}", NUM_ENVS)
        zero = np.zeros(remote.action_space.shape, np.float32)
        remote.reset(seed=0)
        remote.step(zero)
        before = usage.now(server.pid)
        watched, latency, calls, equal = usage.Usage(server.pid), usage.Latency(), 0, True
        end = time.monotonic() + seconds
        while calls == 0 or time.monotonic() < end:
            seed = soak.random.randrange(1 << 40)
            with latency:
                theirs = remote.reset(seed=seed)[0]
            if calls % 20 == 0:
                equal = equal and theirs.tobytes() == local.reset(seed=seed)[0].tobytes()
                equal = equal and remote.step(zero)[0].tobytes() == local.step(zero)[0].tobytes()
            calls += 1
            watched.sample()
        soak.check("after many resets the bits are right", equal, env_id)
        watched.check(soak.tally, f"a server of {env_id}", f"{calls * NUM_ENVS:,} resets")
        watched.check_handles(soak.tally, "the server", before)
        latency.check(soak.tally, f"{NUM_ENVS} resets of {env_id}")
        remote.close()
        local.close()
    return calls * NUM_ENVS
