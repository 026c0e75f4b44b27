#!/usr/bin/env python3
"""RLlib's PPO, with env runners of its own in as many processes, on one machine or a cluster.

  python3 rllib_ppo.py --runners 2                           on this machine
  python3 rllib_ppo.py --runners 40 --address auto           on the cluster that this one is part of

Each runner steps its walkers together, by the threads of its own process. On a cluster `ray start`
has joined the machines, each has this package, and Ray spreads the runners over their processors.

The folder that is saved is RLlib's checkpoint: `Algorithm.from_checkpoint(folder)` goes on with it,
and `RLModule.from_checkpoint(folder + "/learner_group/learner/rl_module/default_policy")` is the
policy alone.

What to expect of BipedalWalker-v3: a mean return of 0 after 310,000 steps, 100 after 450,000 and
about 220 after the 1,000,000 that are the default, in about four minutes on two cores. A line has
the episodes of one update only, so lines differ by more than 100.
"""

import argparse
import importlib
import os
import platform
import time

# Disables Ray's usage reports.
os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
# For networks this small, one thread is faster than several that synchronise.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import gymnasium
import ray
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig
from ray.tune.registry import register_env


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--env", default="walker_sim/BipedalWalker-v3", help="default: %(default)s")
    parser.add_argument("--runners", type=int, default=2, help="processes (%(default)s)")
    parser.add_argument("--num-envs", type=int, default=16, help="walkers of each (%(default)s)")
    parser.add_argument("--threads", type=int, default=1, help="of each (%(default)s)")
    parser.add_argument("--steps", type=int, default=1_000_000, help="of all walkers together")
    parser.add_argument("--rollout", type=int, default=256, help="steps of each between updates")
    parser.add_argument("--seed", type=int, default=1, help="of walkers and learner (%(default)s)")
    parser.add_argument("--save", default="walker_rllib", help="the folder (%(default)s)")
    parser.add_argument("--address", help="of a Ray cluster; without it, one on this machine")
    arguments = parser.parse_args()
    for name in ("runners", "num_envs", "threads", "rollout"):
        value = getattr(arguments, name)
        if value < 1:
            parser.error(f"--{name.replace('_', '-')} {value}: must be at least 1")
    if arguments.steps < batch_size(arguments):
        parser.error(
            f"--steps {arguments.steps}: trains nothing; must be at least {batch_size(arguments)},"
            " one update's: --runners times --num-envs times --rollout"
        )
    return arguments


def batch_size(arguments):
    """Steps of all walkers between two updates."""
    return arguments.runners * arguments.num_envs * arguments.rollout


class Walkers(gymnasium.vector.VectorWrapper):
    """Spaces the runners' seeds. RLlib gives adjacent seeds to its runners, and `reset` to its
    walkers, so most walkers of two runners would otherwise be identical."""

    def reset(self, *, seed=None, options=None):
        return super().reset(seed=None if seed is None else seed * self.num_envs, options=options)


def make_walkers(settings):
    """Returns a runner's walkers. RLlib calls it in each runner's process."""
    importlib.import_module("walker_sim")  # registers the walkers in this process as well
    return Walkers(gymnasium.make_vec(**settings))


def configure(arguments):
    register_env("walkers", make_walkers)
    return (
        PPOConfig()
        .environment("walkers", env_config={"id": arguments.env, "num_threads": arguments.threads})
        .env_runners(
            num_env_runners=arguments.runners,
            num_envs_per_env_runner=arguments.num_envs,
            num_cpus_per_env_runner=arguments.threads,
            # `make_walkers` returns all walkers; by default RLlib would step them one by one
            gym_env_vectorize_mode=gymnasium.VectorizeMode.VECTOR_ENTRY_POINT,
            rollout_fragment_length=arguments.rollout,
        )
        .training(
            train_batch_size_per_learner=batch_size(arguments),
            minibatch_size=min(256, batch_size(arguments)),
            num_epochs=10,
            lr=3e-4,
            gamma=0.99,
            lambda_=0.95,
            clip_param=0.2,
            vf_clip_param=float("inf"),  # RLlib's default is below a walker's returns
            vf_loss_coeff=0.5,
            use_kl_loss=False,
            grad_clip=0.5,
        )
        .rl_module(
            model_config=DefaultModelConfig(
                fcnet_hiddens=[64, 64],
                fcnet_activation="tanh",
                vf_share_layers=False,
                free_log_std=True,
            )
        )
        .debugging(seed=arguments.seed, log_level="ERROR")
    )


def start_ray(arguments):
    if arguments.address:
        ray.init(address=arguments.address)
        return
    ray.init(
        address="local",
        num_cpus=arguments.runners * arguments.threads + 1,  # one for the learner
        object_store_memory=256 << 20,  # [bytes]
        include_dashboard=False,
        _node_ip_address="127.0.0.1",
    )


def learn(arguments, algorithm):
    start = time.perf_counter()
    for _ in range(arguments.steps // batch_size(arguments)):
        result = algorithm.train()
        steps = result["num_env_steps_sampled_lifetime"]
        ended = result["env_runners"]
        episodes = int(min(100, ended.get("num_episodes", 0)))  # RLlib averages the last 100
        shown = f"{ended['episode_return_mean']:.1f}" if episodes else "none ended since"
        rate = steps / (time.perf_counter() - start)
        print(f"{steps:.0f} steps, mean of the last {episodes} returns {shown}, {rate:.0f} steps/s")


def main():
    arguments = parse_arguments()
    start_ray(arguments)
    algorithm = configure(arguments).build_algo()
    processes = algorithm.env_runner_group.foreach_env_runner(
        lambda runner: f"{platform.node()}:{os.getpid()}", local_env_runner=False
    )
    print(f"{arguments.num_envs} walkers in each of the processes", *sorted(processes))
    learn(arguments, algorithm)
    algorithm.save_to_path(os.path.abspath(arguments.save))
    algorithm.stop()
    ray.shutdown()


if __name__ == "__main__":
    main()
