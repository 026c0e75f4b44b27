#!/usr/bin/env python3
"""PPO in one file, in the manner of CleanRL: to be read from top to bottom, and changed.

  python3 cleanrl_ppo.py                                     in this process
  python3 cleanrl_ppo.py --env BipedalWalker-v3              the same on Gymnasium's own walkers

The loop knows Gymnasium's vector environments only. In their usual autoreset mode, next_step, the
step after an episode's end takes no action and gives the next episode's first observation. So the
row after the end holds the final observation, whose value a truncated episode is continued with,
and it is itself left out of the learning.

What to expect of BipedalWalker-v3: a mean return of 0 after 370,000 steps, 100 after 570,000 and
about 200 after the 1,000,000 that are the default, in about three minutes on two cores.
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
from torch import nn
from torch.distributions import Normal

LEARNING_RATE = 3e-4
EPOCHS = 10
MINIBATCHES = 32
DISCOUNT = 0.999
GAE_LAMBDA = 0.95
CLIP = 0.2
VALUE_WEIGHT = 0.5
GRADIENT_NORM = 0.5


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--env", default="walker_sim/BipedalWalker-v3", help="default: %(default)s")
    parser.add_argument("--num-envs", type=int, default=16, help="walkers (%(default)s)")
    parser.add_argument("--steps", type=int, default=1_000_000, help="of all walkers together")
    parser.add_argument("--rollout", type=int, default=512, help="steps of each between updates")
    parser.add_argument("--seed", type=int, default=1, help="of walkers and learner (%(default)s)")
    parser.add_argument("--save", default="walker.pt", help="the agent's file (%(default)s)")
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


def layer(inputs, outputs, gain):
    linear = nn.Linear(inputs, outputs)
    nn.init.orthogonal_(linear.weight, gain)
    nn.init.zeros_(linear.bias)
    return linear


def network(inputs, outputs, gain):
    hidden = [layer(inputs, 64, 2**0.5), nn.Tanh(), layer(64, 64, 2**0.5), nn.Tanh()]
    return nn.Sequential(*hidden, layer(64, outputs, gain))


class Agent(nn.Module):
    """Actor-critic: a Gaussian policy and a state-value estimate."""

    def __init__(self, observation_size, action_size):
        super().__init__()
        self.mean = network(observation_size, action_size, 0.01)
        self.log_deviation = nn.Parameter(torch.zeros(action_size))
        self.critic = network(observation_size, 1, 1.0)

    def policy(self, observations):
        return Normal(self.mean(observations), self.log_deviation.exp())

    def value(self, observations):
        return self.critic(observations).squeeze(-1)


class Rollout:
    """Buffer for `steps` steps of `n` walkers; observations and values have one row more."""

    def __init__(self, steps, n, observation_size, action_size):
        self.observations = torch.zeros(steps + 1, n, observation_size)
        self.values = torch.zeros(steps + 1, n)
        self.actions = torch.zeros(steps, n, action_size)
        self.log_probabilities = torch.zeros(steps, n)
        self.rewards = torch.zeros(steps, n)
        self.terminated = torch.zeros(steps, n, dtype=torch.bool)
        self.ended = torch.zeros(steps, n, dtype=torch.bool)
        self.is_step = torch.zeros(steps, n, dtype=torch.bool)  # false: a reset


class Collector:
    """Fills rollouts and keeps the walkers' state between them."""

    def __init__(self, environments, seed):
        self.environments = environments
        self.returns = np.zeros(environments.num_envs)
        self.last_returns = collections.deque(maxlen=100)
        observations, _ = environments.reset(seed=seed)
        self.observations = torch.as_tensor(observations, dtype=torch.float32)
        self.ended = torch.zeros(environments.num_envs, dtype=torch.bool)

    @torch.no_grad()
    def fill(self, rollout, agent):
        for t in range(len(rollout.rewards)):
            policy = agent.policy(self.observations)
            actions = policy.sample()
            rollout.observations[t] = self.observations
            rollout.values[t] = agent.value(self.observations)
            rollout.actions[t] = actions
            rollout.log_probabilities[t] = policy.log_prob(actions).sum(-1)
            rollout.is_step[t] = ~self.ended
            self._step(actions.clamp(-1, 1).numpy(), rollout, t)
        rollout.observations[-1] = self.observations
        rollout.values[-1] = agent.value(self.observations)

    def _step(self, actions, rollout, t):
        observations, rewards, terminated, truncated, _ = self.environments.step(actions)
        ended = terminated | truncated
        self.returns += rewards
        self.last_returns.extend(self.returns[ended])
        self.returns[ended] = 0
        self.observations = torch.as_tensor(observations, dtype=torch.float32)
        self.ended = torch.as_tensor(ended)
        rollout.rewards[t] = torch.as_tensor(rewards, dtype=torch.float32)
        rollout.terminated[t] = torch.as_tensor(terminated)
        rollout.ended[t] = self.ended


def advantages_of(rollout):
    """Returns the generalised advantage estimates, shape (steps, n)."""
    advantages = torch.zeros_like(rollout.rewards)
    following = torch.zeros_like(rollout.rewards[0])
    for t in reversed(range(len(advantages))):
        next_values = rollout.values[t + 1] * ~rollout.terminated[t]
        errors = rollout.rewards[t] + DISCOUNT * next_values - rollout.values[t]
        following = errors + DISCOUNT * GAE_LAMBDA * following * ~rollout.ended[t]
        advantages[t] = following
    return advantages


def update(agent, optimizer, rollout):
    chosen = rollout.is_step
    observations = rollout.observations[:-1][chosen]
    actions = rollout.actions[chosen]
    log_probabilities = rollout.log_probabilities[chosen]
    advantages = advantages_of(rollout)[chosen]
    returns = advantages + rollout.values[:-1][chosen]
    for _ in range(EPOCHS):
        for rows in torch.randperm(len(returns)).chunk(MINIBATCHES):
            gain = advantages[rows]
            gain = (gain - gain.mean()) / (gain.std(unbiased=False) + 1e-8)
            now = agent.policy(observations[rows]).log_prob(actions[rows]).sum(-1)
            ratio = (now - log_probabilities[rows]).exp()
            policy_loss = -torch.min(gain * ratio, gain * ratio.clamp(1 - CLIP, 1 + CLIP)).mean()
            value_loss = (agent.value(observations[rows]) - returns[rows]).square().mean()
            optimizer.zero_grad()
            (policy_loss + VALUE_WEIGHT * value_loss).backward()
            nn.utils.clip_grad_norm_(agent.parameters(), GRADIENT_NORM)
            optimizer.step()


def main():
    arguments = parse_arguments()
    torch.manual_seed(arguments.seed)
    n = arguments.num_envs
    environments = gymnasium.make_vec(arguments.env, num_envs=n)
    sizes = (
        environments.single_observation_space.shape[0],
        environments.single_action_space.shape[0],
    )
    agent = Agent(*sizes)
    optimizer = torch.optim.Adam(agent.parameters(), LEARNING_RATE, eps=1e-5)
    rollout = Rollout(arguments.rollout, n, *sizes)
    collector = Collector(environments, arguments.seed)
    start = time.perf_counter()
    for steps in range(arguments.rollout * n, arguments.steps + 1, arguments.rollout * n):
        collector.fill(rollout, agent)
        update(agent, optimizer, rollout)
        returns = collector.last_returns
        shown = f"{np.mean(returns):.1f}" if returns else "none ended yet"
        rate = steps / (time.perf_counter() - start)
        print(f"{steps} steps, mean of the last {len(returns)} returns {shown}, {rate:.0f} steps/s")
    environments.close()
    torch.save(agent.state_dict(), arguments.save)


if __name__ == "__main__":
    main()
