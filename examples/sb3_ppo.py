#!/usr/bin/env python3
"""Stable-Baselines3's PPO on many walkers at once: learns, saves the policy, evaluates it.

  python3 sb3_ppo.py                                         learn in this process
  python3 sb3_ppo.py --load walker.zip                       only evaluate what was learnt
  python3 sb3_ppo.py --load walker.zip --transport ros       the same, on a server's walkers

Over ROS the server has to run as many walkers, and to begin the next episode in the same step:
  roslaunch walker_sim walker.launch mode:=lockstep num_envs:=16 autoreset_mode:=same_step

What to expect of BipedalWalker-v3: a mean return of 0 after 380,000 steps, 100 after 720,000 and
about 190, over the episodes of the evaluation, after the 1,000,000 that are the default, in about
three minutes on two cores. `python3 -m walker_sim train` goes on to 300.
"""

import argparse
import os

# For networks this small, one thread is faster than several that synchronise.
os.environ.setdefault("OMP_NUM_THREADS", "1")

from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecMonitor
from walker_sim.sb3 import VecEnv


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--env", default="BipedalWalker-v3", help="default: %(default)s")
    parser.add_argument("--num-envs", type=int, default=16, help="walkers (%(default)s)")
    parser.add_argument("--transport", default="inprocess", choices=["inprocess", "ros"])
    parser.add_argument("--server", default="/walker_sim", help="its node's name, over ROS")
    parser.add_argument("--steps", type=int, default=1_000_000, help="of all walkers together")
    parser.add_argument("--rollout", type=int, default=512, help="steps of each between updates")
    parser.add_argument("--seed", type=int, default=1, help="of walkers and learner (%(default)s)")
    parser.add_argument("--save", default="walker.zip", help="the policy's file (%(default)s)")
    parser.add_argument("--load", help="a policy's file: evaluate it instead of learning")
    parser.add_argument("--episodes", type=int, default=20, help="to evaluate on (%(default)s)")
    arguments = parser.parse_args()
    for name, fewest in (("num_envs", 1), ("rollout", 2)):  # PPO normalises advantages
        value = getattr(arguments, name)
        if value < fewest:
            parser.error(f"--{name.replace('_', '-')} {value}: must be at least {fewest}")
    least = arguments.num_envs * arguments.rollout
    if arguments.steps < least and not arguments.load:
        parser.error(
            f"--steps {arguments.steps}: trains nothing; must be at least {least}, one update's:"
            " --num-envs times --rollout"
        )
    return arguments


def learn(arguments, walkers):
    model = PPO(
        "MlpPolicy",
        walkers,
        n_steps=arguments.rollout,
        batch_size=max(2, arguments.num_envs * arguments.rollout // 32),
        gamma=0.999,
        seed=arguments.seed,
        verbose=1,
        device="cpu",  # faster than a GPU for a network this small
    )
    model.learn(arguments.steps, progress_bar=True)
    model.save(arguments.save)


def main():
    arguments = parse_arguments()
    walkers = VecMonitor(
        VecEnv(
            arguments.env,
            arguments.num_envs,
            transport=arguments.transport,
            server=arguments.server,
        )
    )
    if not arguments.load:
        learn(arguments, walkers)
    model = PPO.load(arguments.load or arguments.save, device="cpu")
    walkers.seed(arguments.seed + arguments.num_envs)  # seeds that training did not use
    mean, deviation = evaluate_policy(model, walkers, arguments.episodes)
    walkers.close()
    print(f"return {mean:.6g} +- {deviation:.6g} over {arguments.episodes} episodes")


if __name__ == "__main__":
    main()
