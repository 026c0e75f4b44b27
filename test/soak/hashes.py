"""The reference run has the documented hash with any pool size, kernel, threads and transport."""

from reference_hashes import HASHES, KERNELS

SECONDS = 120  # minimum duration of a part with the long run [s]


def hashes(soak):
    steps = max(HASHES) if soak.seconds >= SECONDS else min(HASHES)
    with soak.graph() as graph:
        for _ in soak.rounds():
            env_id = soak.random.choice([*HASHES[steps]])
            num_envs = soak.random.choice([1, 2, 5, 16, 33])
            options = ["--num-envs", num_envs]
            environment = {}
            kernel = soak.random.choice(KERNELS)
            how = f"{env_id}, {num_envs} at once"
            if soak.random.random() < 0.3:
                server = graph.server(env=env_id, num_envs=num_envs)
                options += ["--transport", "ros"]
                how += ", over ROS"
            else:
                server = None
                threads = soak.random.choice([1, 2, 3, 8])
                options += ["--num-threads", threads]
                how += f", {threads} threads, kernel {kernel or 'chosen'}"
                if kernel:
                    environment["WALKER_SIM_KERNEL"] = kernel
            done = graph.run("hash", env_id, "--steps", steps, *options, environment=environment)
            found = [line.split()[0] for line in done.stdout.splitlines()[1:]]
            soak.check(
                f"{steps:,} steps of 16 walkers have the documented hash",
                found == [HASHES[steps][env_id]],
                f"{how}: {found or done.stderr}",
            )
            if server:
                server.end()
