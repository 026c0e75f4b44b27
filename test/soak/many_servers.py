"""Ten servers on one master, each with its own agent."""

from concurrent.futures import ThreadPoolExecutor

import usage
from walk import Pair

IDS = ("BipedalWalker-v3", "Walker2d-v5", "Hopper-v5", "BipedalWalkerHardcore-v3")
SERVERS = 10


def run(soak):
    with soak.graph() as graph:
        servers, pairs = [], []
        for number in range(SERVERS):
            env_id = IDS[number % len(IDS)]
            servers.append(graph.server(f"/walker_{number}", env=env_id, publish_clock="false"))
            pairs.append(Pair(servers[-1].name, graph.uri, 30.0, env_id))
        soak.begin()
        watched = [usage.Usage(server.pid) for server in servers]

        def walk(number):
            pair, steps = pairs[number], 0
            pair.reset(number)
            pair.step()
            before, equal = usage.now(servers[number].pid), True
            while steps == 0 or soak.goes_on():
                equal = pair.steps(50) and equal
                steps += 50
                watched[number].sample()
            return before, equal, steps

        with ThreadPoolExecutor(SERVERS) as threads:
            results = list(threads.map(walk, range(SERVERS)))
        for number, (before, equal, _) in enumerate(results):
            soak.check(f"each of {SERVERS} servers returns the right bits", equal, number)
            watched[number].check(soak.tally, f"each of {SERVERS} servers")
            watched[number].check_handles(soak.tally, "each server", before)
            pairs[number].close()
        growth = max((one.growth() for one in watched if one.is_long_enough()), default=0.0)
        soak.figure(
            f"{SERVERS} servers, {sum(steps for *_, steps in results):,} steps: largest growth in"
            " the second half",
            f"{growth / usage.MIB:+.2f} MiB",
        )
