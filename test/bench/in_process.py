"""Measurements without ROS: speed of one core and of the pool, resets, memory, policies."""

import numpy as np
from measure import (
    Plan,
    against,
    first_line,
    kilobytes,
    microseconds_of_processor_time,
    steps_per_processor_second,
    steps_per_second,
)
from walker_sim.commands.policies import shipped_policy
from walker_sim.training.policy_file import PolicyFile, write_policy

IDS = ("BipedalWalker-v3", "BipedalWalkerHardcore-v3", "Walker2d-v4", "Walker2d-v5", "Hopper-v5")
POOLED_IDS = ("BipedalWalker-v3", "Walker2d-v4")
KERNELS = ("avx2", "sse2")  # measured besides the default
SIZES = (1, 16, 64, 256, 1024)
SCALED_SIZES = (64, 256)  # pool sizes of the scaling section
WORLDS = {
    "physics": "gravity: [-11, -9], friction_scale: [0.8, 1.2], motor_strength: [0.9, 1.1], "
    "mass_scale: [0.9, 1.1], joint_damping: [0.05, 0.15]",
    "pushes": "push_interval: [0.5, 2]",
    "delays": "action_delay: 0.04, observation_delay: 0.04",
    "noise": "action_noise: 0.05, dropout: 0.1, joint_position_noise: 0.02, "
    "joint_velocity_noise: 0.2, orientation_noise: 0.02, angular_velocity_noise: 0.1, "
    "linear_velocity_noise: 0.1",
}
LEVELS = {"BipedalWalker-v3": "hard", "Walker2d-v4": "walker2d_stairs"}
CROWD = 1000  # environments of the memory section


def kernel_of(settings, env, *prefix):
    """Returns the instruction set of the pools' kernel: the last word of `describe --engine`."""
    return first_line(*prefix, settings.programs / "describe", env, "--engine").split()[-1]


def core(settings):
    """One thread on one core; BipedalWalker also with smaller kernels."""
    plan = Plan("core", "steps/s", steps_per_processor_second, settings.folder)
    one = ["--seconds", settings.seconds(0.6)]
    for env in IDS:

        def add(side, command, sizes=(1,), env=env):
            return plan.add(side, env, command, settings.one_core, sizes)

        for size in (16, 64):
            many = [*one, "--num-envs", size, "--threads", 1]
            pooled = add(f"pool, {size}", settings.ours("pool", env, *many), (size,))
            envpool = add(f"EnvPool, {size}", settings.peer("envpool", env, *many), (size,))
            against(pooled, envpool)
        for kernel in KERNELS if env == "BipedalWalker-v3" else ():
            # If the processor does not support the kernel, the variable selects a smaller one.
            variable = ["env", f"WALKER_SIM_KERNEL={kernel}"]
            is_default = kernel == kernel_of(settings, env)
            if not is_default and kernel_of(settings, env, *variable) == kernel:
                command = [*variable, *settings.ours("pool", env, *many)]
                against(add(f"pool, 64, {kernel}", command, (64,)), envpool)
        add("mjbatch, 64", settings.mjbatch(env, *many), (64,))
        single = add("single", settings.ours("loop", env, *one))
        against(single, add("Gymnasium", settings.peer("gymnasium", env, *one)))
    return plan.run(settings.rounds(4))


def pool(settings):
    """Pools of every size with one thread on one core, and with two threads on two."""
    plan = Plan("pool", "steps/s", steps_per_second, settings.folder)
    sizes = ["--num-envs", ",".join(map(str, SIZES)), "--seconds", settings.seconds(0.2)]
    for env in POOLED_IDS:
        for cores in (settings.one_core, settings.two_cores):
            threads = len(cores)
            options = [env, *sizes, "--threads", threads]

            def add(side, command, env=env, cores=cores):
                return plan.add(side, env, command, cores, SIZES, threads=len(cores))

            ours = add("walker_sim", settings.ours("pool", *options))
            ours_async = add("walker_sim, async", settings.ours("async", *options))
            against(ours, add("EnvPool", settings.peer("envpool", *options)))
            envpool_async = settings.peer("envpool-async", *options)
            against(ours_async, add("EnvPool, async", envpool_async))
        options = ["--num-envs", 16, "--seconds", settings.seconds(0.5)]
        command = settings.peer("gymnasium-vector", env, *options)
        plan.add("Gymnasium, processes", env, command, cores, (16,), threads=len(cores))
    return plan.run(settings.rounds(3))


def worlds(settings):
    """64 walkers on one core: what each group of a world's parameters costs, and all together."""
    plan = Plan("worlds", "steps/s", steps_per_processor_second, settings.folder)
    size = ["--num-envs", 64, "--threads", 1, "--seconds", settings.seconds(0.6)]
    for env in POOLED_IDS:

        def add(side, world, env=env):
            command = settings.ours("world", env, *size, "--world", world)
            return plan.add(side, env, command, settings.one_core, (64,))

        plain = add("plain", "gymnasium")
        for side, text in WORLDS.items():
            against(add(side, f"{{{text}}}"), plain)
        against(add("all of these", f"{{{', '.join(WORLDS.values())}}}"), plain)
        against(add("levels", LEVELS[env]), plain)
    return plan.run(settings.rounds(4))


def scaling(settings):
    """One thread against two, beside the limit of two cores: one process on each."""
    plan = Plan("scaling", "steps/s", steps_per_second, settings.folder)
    two = settings.two_cores
    for env in POOLED_IDS:

        def pool(threads, env=env):
            options = ["--num-envs", ",".join(map(str, SCALED_SIZES)), "--threads", threads]
            return settings.ours("pool", env, *options, "--seconds", settings.seconds(0.5))

        one = plan.add("one thread", env, pool(1), settings.one_core, SCALED_SIZES)
        against(plan.add("two threads", env, pool(2), two, SCALED_SIZES), one)
        against(plan.add("two processes", env, pool(1), two, SCALED_SIZES, apart=True), one)
    return plan.run(settings.rounds(6))


def python(settings):
    """Environments made through Gymnasium: a single one on one core, and many on two;
    and whole episodes, with the policy's arithmetic."""
    plan = Plan("python", "steps/s", steps_per_second, settings.folder)
    seconds = ["--seconds", settings.seconds(0.6)]
    two, size = settings.two_cores, 64
    many = ["--num-envs", size, "--threads", len(two), *seconds]
    for env in POOLED_IDS:

        def add(side, command, cores=settings.one_core, sizes=(1,), env=env):
            return plan.add(side, env, command, cores, sizes)

        single = add("gymnasium.make", settings.python("gymnasium", env, *seconds))
        against(single, add("Gymnasium", settings.peer("gymnasium", env, *seconds)))
        vector = add("make_vec, 64", settings.python("make_vec", env, *many), two, (size,))
        pool = add("pool, 64", settings.ours("pool", env, *many), two, (size,))
        against(vector, pool)
        episodes = ["--num-envs", 256, "--threads", len(two), *seconds]
        played = settings.python("play_out", env, *episodes)
        against(add("play_out, shipped policy, 256 episodes", played, two, (256,)), pool)
    return plan.run(settings.rounds(6))


def act(settings):
    """Forward passes of policies: the shipped networks, and one with layers of 256 and 256."""
    plan = Plan("act", "us", microseconds_of_processor_time, settings.folder)
    sizes = (17, 256, 256, 6)
    layers = [
        (np.full((outputs, inputs), 0.01), np.full(outputs, 0.01))
        for inputs, outputs in zip(sizes, sizes[1:])
    ]
    file = settings.folder / "large.safetensors"
    limits = -np.ones(6), np.ones(6)
    statistics = np.zeros(17), np.ones(17)
    write_policy(PolicyFile("Walker2d-v5", {}, "tanh", "clip", *statistics, *limits, layers), file)
    for name, path in (("17-256-256-6", file), *((env, shipped_policy(env)) for env in IDS)):
        command = [settings.programs / "walker_sim_benchmark", "act", "--file", path]
        command += ["--seconds", settings.seconds(0.2)]
        plan.add("action", name, command, settings.one_core)
    return plan.run(settings.rounds(3))


def reset(settings):
    """Resets; EnvPool resets 16 environments per call to reduce Python's overhead per reset."""
    plan = Plan("reset", "us", microseconds_of_processor_time, settings.folder)
    seconds = ["--seconds", settings.seconds(0.2)]
    core = settings.one_core
    for env in IDS:
        ours = plan.add("walker_sim", env, settings.ours("reset", env, *seconds), core)
        envpool = plan.add("EnvPool", env, settings.peer("envpool-reset", env, *seconds), core)
        plan.add("Gymnasium", env, settings.peer("gymnasium-reset", env, *seconds), core)
        against(ours, envpool)
    return plan.run(settings.rounds(3))


def memory(settings):
    """Resident memory per environment after 100 steps, without what all environments share."""
    plan = Plan("memory", "kB", kilobytes, settings.folder)
    core = settings.one_core
    for env in POOLED_IDS:
        crowd = settings.count(CROWD)
        size = ["--num-envs", crowd, "--steps", 100]
        ours = plan.add("walker_sim", env, settings.ours("memory", env, *size), core, (crowd,))
        envpool = settings.peer("envpool-memory", env, *size)
        against(ours, plan.add("EnvPool", env, envpool, core, (crowd,)))
        few = settings.count(CROWD // 10)
        size = ["--num-envs", few, "--steps", 100]
        gymnasium = settings.peer("gymnasium-memory", env, *size)
        plan.add("Gymnasium", env, gymnasium, core, (few,))
    return plan.run(1)
