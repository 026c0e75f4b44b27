"""Ten servers on one master, each with its own agent."""

import usage
from several_clients import together
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
        before = []
        equal, steps = [True] * SERVERS, [0] * SERVERS

        def walk(number):
            pair = pairs[number]
            pair.reset(number)
            pair.step()
            before.append((number, usage.now(servers[number].pid)))
            while steps[number] == 0 or soak.goes_on():
                equal[number] = pair.steps(50) and equal[number]
                steps[number] += 50
                watched[number].sample()

        together(*[lambda number=number: walk(number) for number in range(SERVERS)])
        for number in range(SERVERS):
            soak.check(f"each of {SERVERS} servers gives the right bits", equal[number], number)
            watched[number].judge(soak.tally, f"each of {SERVERS} servers")
        for number, handles in before:
            watched[number].judge_handles(soak.tally, "each server", handles)
        for pair in pairs:
            pair.close()
        most = max((one.growth() for one in watched if one.can_tell()), default=0.0)
        soak.figure(
            f"{SERVERS} servers, {sum(steps):,} steps: largest growth in the second half",
            f"{most / usage.MIB:+.2f} MiB",
        )
