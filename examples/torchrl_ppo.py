#!/usr/bin/env python3
"""TorchRL's PPO on many walkers at once, which are one batched environment to it.

  python3 torchrl_ppo.py                                     in this process

TorchRL itself says which walkers begin another episode, by the mask that a reset takes in the
autoreset mode `disabled`.

What to expect of BipedalWalker-v3: a mean return of 0 after 420,000 steps, 100 after 750,000 and
about 170 after the 1,000,000 that are the default, in about four minutes on two cores.
"""

import argparse
import collections
import os
import time

# For networks this small, one thread is faster than several that synchronise.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import gymnasium
import numpy as np
import torch
import walker_sim  # noqa: F401  # registers the walkers with Gymnasium
from tensordict.nn import AddStateIndependentNormalScale, TensorDictModule
from torch import nn
from torchrl.collectors import Collector
from torchrl.envs import Compose, DoubleToFloat, GymWrapper, RewardSum, TransformedEnv
from torchrl.modules import MLP, ProbabilisticActor, TanhNormal, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

EPOCHS = 10
MINIBATCH = 256


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--env", default="walker_sim/BipedalWalker-v3", help="default: %(default)s")
    parser.add_argument("--num-envs", type=int, default=64, help="walkers (%(default)s)")
    parser.add_argument("--steps", type=int, default=1_000_000, help="of all walkers together")
    parser.add_argument("--rollout", type=int, default=128, help="steps of each between updates")
    parser.add_argument("--seed", type=int, default=1, help="of walkers and learner (%(default)s)")
    parser.add_argument("--save", default="walker.pt", help="the policy's file (%(default)s)")
    arguments = parser.parse_args()
    for name in ("num_envs", "rollout"):
        value = getattr(arguments, name)
        if value < 1:
            parser.error(f"--{name.replace('_', '-')} {value}: must be at least 1")
    least = arguments.num_envs * arguments.rollout
    if arguments.steps < least:
        parser.error(
            f"--steps {arguments.steps}: trains nothing; must be at least {least}, one update's:"
            " --num-envs times --rollout"
        )
    return arguments


def make_walkers(arguments):
    walkers = gymnasium.make_vec(
        arguments.env, num_envs=arguments.num_envs, autoreset_mode="disabled"
    )
    transforms = Compose(DoubleToFloat(), RewardSum())
    environment = TransformedEnv(GymWrapper(walkers), transforms)
    environment.set_seed(arguments.seed)
    return environment


def network(outputs):
    return MLP(out_features=outputs, num_cells=[64, 64], activation_class=nn.Tanh)


def make_actor(environment):
    """Returns the actor: a normal distribution, tanh-squashed to the action bounds."""
    space = environment.action_spec_unbatched
    mean = nn.Sequential(network(space.shape[-1]), AddStateIndependentNormalScale(space.shape[-1]))
    return ProbabilisticActor(
        TensorDictModule(mean, in_keys=["observation"], out_keys=["loc", "scale"]),
        in_keys=["loc", "scale"],
        spec=space,
        distribution_class=TanhNormal,
        distribution_kwargs={"low": space.space.low, "high": space.space.high},
        return_log_prob=True,
    )


def update(loss, advantage, optimizer, rollout):
    with torch.no_grad():
        advantage(rollout)
    steps = rollout.reshape(-1)
    for _ in range(EPOCHS):
        for rows in torch.randperm(len(steps)).split(MINIBATCH):
            losses = loss(steps[rows])
            optimizer.zero_grad()
            (losses["loss_objective"] + losses["loss_critic"]).backward()
            nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
            optimizer.step()


def main():
    arguments = parse_arguments()
    torch.manual_seed(arguments.seed)
    environment = make_walkers(arguments)
    actor = make_actor(environment)
    critic = ValueOperator(network(1), in_keys=["observation"])
    with torch.no_grad():  # sets the input size of the lazy layers
        first = environment.reset()
        critic(actor(first))
    loss = ClipPPOLoss(
        actor,
        critic,
        clip_epsilon=0.2,
        entropy_bonus=False,
        critic_coeff=0.5,
        loss_critic_type="l2",
        normalize_advantage=True,
    )
    advantage = GAE(gamma=0.99, lmbda=0.95, value_network=critic, average_gae=False)
    optimizer = torch.optim.Adam(loss.parameters(), 3e-4, eps=1e-5)
    batch = arguments.num_envs * arguments.rollout
    updates = arguments.steps // batch
    collector = Collector(
        environment,
        actor,
        frames_per_batch=batch,
        total_frames=updates * batch,
        auto_register_policy_transforms=False,  # only recurrent networks need these
    )
    returns = collections.deque(maxlen=100)
    start = time.perf_counter()
    for number, rollout in enumerate(collector, 1):
        update(loss, advantage, optimizer, rollout)
        following = rollout["next"]
        returns.extend(following["episode_reward"][following["done"]].tolist())
        shown = f"{np.mean(returns):.1f}" if returns else "none ended yet"
        steps = number * batch
        rate = steps / (time.perf_counter() - start)
        print(f"{steps} steps, mean of the last {len(returns)} returns {shown}, {rate:.0f} steps/s")
    collector.shutdown()
    torch.save(actor.state_dict(), arguments.save)


if __name__ == "__main__":
    main()
