"""Performance targets and their verdicts."""

import dataclasses
from typing import Callable, Optional

BIPEDAL, WALKER2D = "BipedalWalker-v3", "Walker2d-v4"
HARDCORE = "BipedalWalkerHardcore-v3"
KERNEL_LIMITS = {"avx2": 4.0, "sse2": 3.0}  # minimum ratio to EnvPool of 64 BipedalWalkers
LARGE = "17-256-256-6"
WALKERS = (
    *("BipedalWalker-v3", "BipedalWalkerHardcore-v3", "Walker2d-v4", "Walker2d-v5"),
    *("Hopper-v4", "Hopper-v5"),
)


@dataclasses.dataclass
class Target:
    what: str
    limit: float
    measure: Callable  # of all rows; returns None if not measured
    is_most: bool = False  # the limit is a maximum, else a minimum
    unit: str = ""
    is_in_readme: bool = False  # shown in README's table
    section: str = ""  # of a long measurement: a target only if it was run

    def verdict(self, rows):
        value = self.measure(rows)
        if value is None:
            return None, "not measured"
        reached = value <= self.limit if self.is_most else value >= self.limit
        return value, "reached" if reached else "NOT REACHED"


def find(rows, section, environment, side, **attributes) -> Optional[object]:
    wanted = {"section": section, "environment": environment, "side": side, **attributes}
    for row in rows:
        if all(getattr(row, name) == value for name, value in wanted.items()):
            return row
    return None


def ratio(*names, **attributes):

    def measure(rows):
        row = find(rows, *names, **attributes)
        return row.ratio if row else None

    return measure


def median(*names):
    def measure(rows):
        row = find(rows, *names)
        return None if row is None or row.error else row.median

    return measure


TARGETS = (
    *(
        Target(
            f"one core, {size} {environment.split('-')[0]}s, against EnvPool",
            limit,
            ratio("core", environment, f"pool, {size}"),
            is_in_readme=size == 64,
        )
        for environment, size, limit in (
            (BIPEDAL, 64, 4.0),
            (BIPEDAL, 16, 3.0),
            (HARDCORE, 64, 3.0),
            (WALKER2D, 64, 9),
            (WALKER2D, 16, 9),
        )
    ),
    *(
        Target(
            f"one core, 64 BipedalWalkers with {kernel.upper()}, against EnvPool",
            limit,
            ratio("core", BIPEDAL, f"pool, 64, {kernel}"),
        )
        for kernel, limit in KERNEL_LIMITS.items()
    ),
    Target(
        "one core, a single Walker2d, against Gymnasium",
        4.5,
        ratio("core", WALKER2D, "single"),
        is_in_readme=True,
    ),
    *(
        Target(
            f"two threads, 64 {environment.split('-')[0]}s, against EnvPool{mode}",
            limit,
            ratio("pool", environment, f"walker_sim{mode}", num_envs=64, threads=2),
            is_in_readme=not mode,
        )
        for environment, limit in ((BIPEDAL, 2.5), (WALKER2D, 5))
        for mode in ("", ", async")
    ),
    *(
        Target(
            f"two threads against one, {size} {name.split('-')[0]}s",
            1.9,
            ratio("scaling", name, "two threads", num_envs=size),
        )
        for name in (BIPEDAL, WALKER2D)
        for size in (64, 256)
    ),
    Target(
        "lock-step over ROS, our client, against Gymnasium in process, one core each",
        2.0,
        ratio("lockstep", BIPEDAL, "our client", placement="1 core"),
        is_in_readme=True,
    ),
    Target(
        "the same with Walker2d",
        4.0,
        ratio("lockstep", WALKER2D, "our client", placement="1 core"),
        is_in_readme=True,
    ),
    Target("the same with rospy", 1.3, ratio("lockstep", BIPEDAL, "rospy", placement="1 core")),
    Target(
        "the same with gymnasium.make",
        1.5,
        ratio("lockstep", BIPEDAL, "gymnasium.make", placement="1 core"),
    ),
    Target(
        "gymnasium.make, BipedalWalker, against Gymnasium's own",
        2.0,
        ratio("python", BIPEDAL, "gymnasium.make"),
        is_in_readme=True,
    ),
    *(
        Target(
            f"make_vec of 64 {name.split('-')[0]}s against the C++ pool, two threads",
            limit,
            ratio("python", name, "make_vec, 64", num_envs=64),
        )
        for name, limit in ((BIPEDAL, 0.85), (WALKER2D, 0.8))
    ),
    *(
        Target(
            f"round trip without physics against raw TCP, {placement}",
            0.6,
            ratio("lockstep", BIPEDAL, "our client, no physics", placement=placement),
        )
        for placement in ("1 core", "2 cores")
    ),
    Target(
        "step_batch of 64 against the pool in process",
        0.85,
        ratio("step_batch", BIPEDAL, "step_batch", num_envs=64),
    ),
    Target(
        "an action of a policy of 256 and 256",
        20,
        median("act", LARGE, "action"),
        is_most=True,
        unit=" us",
    ),
    Target(
        "memory, BipedalWalker, against EnvPool",
        0.6,
        ratio("memory", BIPEDAL, "walker_sim"),
        is_most=True,
    ),
    Target(
        "memory, Walker2d",
        20,
        median("memory", WALKER2D, "walker_sim"),
        is_most=True,
        unit=" kB",
    ),
    *(
        Target(
            f"roslaunch to the first step, {name.split('-')[0]}",
            1.5,
            median("start", name, "roslaunch"),
            is_most=True,
            unit=" s",
        )
        for name in (BIPEDAL, "Walker2d-v5")
    ),
    Target(
        "from nothing to a walker, with Gymnasium's walkers against ours",
        2.5,
        ratio("training", BIPEDAL, "Gymnasium's in DummyVecEnv"),
        section="training",
    ),
    *(
        Target(
            f"{name}'s policy in real time against lock-step",
            0.95,
            ratio("policies", name, "free-running"),
            section="policies",
        )
        for name in WALKERS
    ),
)


def targets_of(rows):
    sections = {row.section for row in rows}
    return [target for target in TARGETS if target.section in {"", *sections}]
