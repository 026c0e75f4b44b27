#!/usr/bin/env python3
"""Rollouts of many walkers by Ray actors, to a file of transitions.

  python3 ray_rollouts.py --actors 2                         on this machine
  python3 ray_rollouts.py --actors 40 --address auto         on the cluster that this one is part of

Every walker has its own seed, its own noise and its own arithmetic, so the file holds the same
numbers for equal seeds, however many actors share the walkers.

The file's arrays, with a row per step and a column per walker: `observations` (one row more, after
the last step), `actions`, `rewards`, `terminated`, `truncated`, and `is_step`, false where, after
an episode's end, the walker was reset instead of stepped.

What to expect of BipedalWalker-v3: nothing is learnt here, and the linear policy of random numbers
falls after about 120 steps, with returns of about -110; 64,000 steps take a few seconds.
"""

import argparse
import importlib
import os
import time

# Disables Ray's usage reports.
os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")

import gymnasium
import numpy as np
import ray
import walker_sim  # noqa: F401  # registers the walkers with Gymnasium


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--env", default="walker_sim/BipedalWalker-v3", help="default: %(default)s")
    parser.add_argument("--walkers", type=int, default=64, help="of all actors (%(default)s)")
    parser.add_argument("--actors", type=int, default=2, help="processes (%(default)s)")
    parser.add_argument("--threads", type=int, default=1, help="of each actor (%(default)s)")
    parser.add_argument("--steps", type=int, default=1000, help="of each walker (%(default)s)")
    parser.add_argument("--noise", type=float, default=0.5, help="deviation, added to actions")
    parser.add_argument("--seed", type=int, default=1, help="of policy and walkers (%(default)s)")
    parser.add_argument("--save", default="rollouts.npz", help="file (%(default)s)")
    parser.add_argument("--address", help="of a Ray cluster; without it, one on this machine")
    arguments = parser.parse_args()
    if not 1 <= arguments.actors <= arguments.walkers:
        parser.error(
            f"--actors {arguments.actors}: must be from 1 to --walkers, {arguments.walkers}"
        )
    if arguments.steps < 1:
        parser.error(f"--steps {arguments.steps}: collects nothing; must be at least 1")
    return arguments


def act(weights, observations):
    """Linear policy. Sums row by row: a matrix product's last bit depends on its number of rows."""
    return (weights * observations[:, None, :]).sum(axis=2)


@ray.remote
class Collector:
    """Steps some of the walkers in its own process."""

    def __init__(self, env_id, walkers, seed, threads):
        importlib.import_module("walker_sim")  # registers the walkers in this process as well
        self.environments = gymnasium.make_vec(env_id, num_envs=len(walkers), num_threads=threads)
        self.observations, _ = self.environments.reset(seed=[seed + walker for walker in walkers])
        self.random = [np.random.default_rng([seed, walker]) for walker in walkers]
        self.ended = np.zeros(len(walkers), bool)

    def collect(self, weights, noise, steps):
        """Steps each walker `steps` times. Returns named arrays of shape (steps, walkers, ...)."""
        columns = {
            name: []
            for name in ("observations", "actions", "rewards", "terminated", "truncated", "is_step")
        }
        for _ in range(steps):
            disturbance = [random.normal(0, noise, len(weights)) for random in self.random]
            actions = np.clip(act(weights, self.observations) + disturbance, -1, 1)
            actions = actions.astype(np.float32)
            observations, rewards, terminated, truncated, _ = self.environments.step(actions)
            row = (self.observations, actions, rewards, terminated, truncated, ~self.ended)
            for column, values in zip(columns.values(), row):
                column.append(values)
            self.observations, self.ended = observations, terminated | truncated
        columns["observations"].append(self.observations)
        return {name: np.array(column) for name, column in columns.items()}


def start_ray(arguments):
    if arguments.address:
        ray.init(address=arguments.address)
        return
    ray.init(
        address="local",
        num_cpus=arguments.actors * arguments.threads,
        object_store_memory=256 << 20,  # [bytes]
        include_dashboard=False,
        _node_ip_address="127.0.0.1",
    )


def collect_all(arguments):
    """Returns the named arrays of all walkers, joined over the actors."""
    with gymnasium.make(arguments.env) as walker:
        shape = (walker.action_space.shape[0], walker.observation_space.shape[0])
    weights = ray.put(np.random.default_rng(arguments.seed).normal(0, 0.3, shape))
    collectors = [
        Collector.options(num_cpus=arguments.threads).remote(
            arguments.env, walkers.tolist(), arguments.seed, arguments.threads
        )
        for walkers in np.array_split(np.arange(arguments.walkers), arguments.actors)
    ]
    parts = ray.get(
        [
            collector.collect.remote(weights, arguments.noise, arguments.steps)
            for collector in collectors
        ]
    )
    return {name: np.concatenate([part[name] for part in parts], axis=1) for name in parts[0]}


def main():
    arguments = parse_arguments()
    start_ray(arguments)
    start = time.perf_counter()
    rollouts = collect_all(arguments)
    seconds = time.perf_counter() - start
    ray.shutdown()
    np.savez_compressed(arguments.save, **rollouts)
    steps = rollouts["is_step"].sum()
    episodes = (rollouts["terminated"] | rollouts["truncated"]).sum()
    print(
        f"{steps} steps of {arguments.walkers} walkers by {arguments.actors} actors, {episodes}"
        f" episodes ended, {seconds:.1f} s with the actors' start: {arguments.save}"
    )


if __name__ == "__main__":
    main()
