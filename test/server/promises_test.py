"""Each script gives the server's services the oracle's trace, to the bit."""

import io
import itertools
import math
import os
import re
import tempfile
from collections import Counter

from bare_ros import wait_for
from node_processes import run_program
from promises import (
    ALL,
    CASES,
    NUM_WALKERS,
    SCRIPTS,
    Interface,
    SingleWalkers,
    check,
    has_states,
    play,
    write_model,
)
from server_harness import ServerTest, recorded_topics, to_message, values_of
from walker_sim.msg import EpisodeRecord

MODES = ("next_step", "same_step", "disabled")


class Services:
    """Calls the services of a server; RuntimeError if a call is refused."""

    def __init__(self, server):
        self.server, self._clients = server, {}

    def __getattr__(self, name):
        if name not in self._clients:
            self._clients[name] = self.server.client(name)

        def call(**fields):
            response = self._clients[name](**fields)
            if not getattr(response, "success", True):
                raise RuntimeError(response.status_message)
            return response

        return call

    def close(self):
        for client in self._clients.values():
            client.close()


def info_of(names, values):
    return {name: value for name, value in zip(names, values) if not math.isnan(value)}


class Singles(SingleWalkers):
    """~reset, ~set_world, ~set_state, ~snapshot, ~restore, and in turn ~step, ~step_many and
    ~step_batch."""

    def __init__(self, spec, services):
        super().__init__(spec.action_size, spec.info_names)
        self.services, self.num_steps = services, 0

    def info_of(self, transition):
        info = info_of(self.info_names, transition.info)
        return {**info, "error": transition.error} if transition.error else info

    def reset_one(self, walker, seed):
        try:
            reply = self.services[walker].reset(has_seed=seed is not None, seed=seed or 0)
        except RuntimeError as error:  # its text begins with whose reset failed
            self.add_reset(walker, [], {"error": str(error).rpartition("reset: ")[2]})
            return
        info = {**self.info_of(reply.transition), "world": values_of(reply.world)}
        self.add_reset(walker, reply.transition.observation, info)

    def step_one(self, walker, action):
        self.num_steps += 1
        services = self.services[walker]
        if self.num_steps % 3 == 0:
            self.add_batch(walker, services.step_batch(actions=action))
            return
        if self.num_steps % 3 == 1:
            state = services.step(action=action).transition
        else:
            state = services.step_many(action=action, steps=1).transition
        ends = state.terminated, state.truncated
        self.add_step(walker, state.observation, state.reward, *ends, self.info_of(state))

    def add_batch(self, walker, reply):
        info = info_of(self.info_names, reply.info)
        if reply.failures:
            info["error"] = reply.failures[0]
        ends = reply.terminated[0], reply.truncated[0]
        self.add_step(walker, reply.observations, reply.rewards[0], *ends, info)

    def set_world(self, walker, world):
        self.services[walker].set_world(worlds=[to_message(world)])

    def set_coordinates(self, walker, position, velocity):
        self.services[walker].set_state(position=position, velocity=velocity)

    def save(self, walker):
        record = io.BytesIO()
        self.services[walker].snapshot().record.serialize(record)
        return record.getvalue()

    def load(self, walker, state):
        self.services[walker].restore(record=EpisodeRecord().deserialize(state))


class Batch(Interface):
    """~reset_batch, ~step_batch, ~set_world and ~set_state."""

    def __init__(self, spec, services):
        super().__init__(spec.action_size, spec.info_names)
        self.services, self.mode = services, spec.autoreset_mode
        self.resets_at_once = self.mode != "next_step"
        self.observation_size = spec.observation_size

    def rows(self, observations, info, count):
        """Returns observation and info of each row."""
        size, num_infos = self.observation_size, len(self.info_names)
        assert len(observations) == count * size and len(info) == count * num_infos
        return [
            (
                observations[i * size : (i + 1) * size],
                info_of(self.info_names, info[i * num_infos : (i + 1) * num_infos]),
            )
            for i in range(count)
        ]

    def add_first(self, walker, row, reply, failures):
        observation, info = row
        drawn = {each.environment: values_of(each.parameters) for each in reply.worlds}
        error = {"error": failures[walker]} if walker in failures else {}
        self.add_reset(walker, observation, {**info, **error, "world": drawn.get(walker, {})})

    def reset(self, walkers, seed=None):
        seeds = {} if seed is None else {"seeds": [seed + walker for walker in walkers]}
        has_seed = [1] * len(walkers) if seeds else []
        reply = self.services.reset_batch(environments=walkers, has_seed=has_seed, **seeds)
        failures = dict(zip(reply.failed_environments, reply.failures))
        rows = self.rows(reply.observations, reply.info, len(walkers))
        for walker, row in zip(walkers, rows):
            self.add_first(walker, row, reply, failures)

    def step(self, actions):
        reply = self.services.step_batch(actions=[value for row in actions for value in row])
        failures = [{}, {}]  # at steps, at resets
        for walker, at_reset, text in zip(
            reply.failed_environments, reply.failed_at_reset, reply.failures
        ):
            failures[at_reset][walker] = text
        rows = self.rows(reply.observations, reply.info, NUM_WALKERS)
        finals = reply.final_environments
        final_rows = self.rows(reply.final_observations, reply.final_info, len(finals))
        final_rows = dict(zip(finals, final_rows))
        ended = []
        for walker in ALL:
            if self.has_ended[walker]:
                self.add_first(walker, rows[walker], reply, failures[1])
                continue
            observation, info = final_rows.get(walker, rows[walker])
            if walker in failures[0]:
                info["error"] = failures[0][walker]
            ends = reply.terminated[walker], reply.truncated[walker]
            self.add_step(walker, observation, reply.rewards[walker], *ends, info)
            if walker in final_rows:
                self.add_first(walker, rows[walker], reply, failures[1])
            elif any(ends):
                ended.append(walker)
        if self.mode == "disabled" and ended:
            self.reset(ended)

    def set_world(self, walker, world):
        self.services.set_world(environments=[walker], worlds=[to_message(world)])

    def set_coordinates(self, walker, position, velocity):
        self.services.set_state(environment=walker, position=position, velocity=velocity)


class PromisesTest(ServerTest):
    def serve_case(self, case, count, **parameters):
        """Starts servers. Returns their services and the specification."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        parameters = {"mode": "lockstep", "publish_clock": False, "env": case.env_id, **parameters}
        parameters.update(write_model(case, folder.name))
        servers = [self.start(f"/walker_{i}/walker_sim", **parameters) for i in range(count)]
        services = [Services(server.wait_until_it_serves()) for server in servers]
        for each in services:
            self.addCleanup(each.close)
        return services, services[0].get_spec().spec

    def check_all(self, case, make, scripts):
        for script in scripts:
            walkers = make()
            for walker in ALL:
                walkers.set_world(walker, "gymnasium")  # the server keeps the last one
            check(script, case, walkers)

    def test_one_walker(self):
        for case in CASES.values():
            services, spec = self.serve_case(case, NUM_WALKERS)
            with self.subTest(case.name):
                self.check_all(case, lambda s=services, p=spec: Singles(p, s), SCRIPTS)
            self.doCleanups()

    def test_many_walkers(self):
        scripts = [script for script in SCRIPTS if not has_states(script)]
        for mode in MODES:
            for case in CASES.values():
                # No walker can step beside one that could not be reset.
                if (mode, case.name) != ("disabled", "cramped"):
                    given = {"num_envs": NUM_WALKERS, "autoreset_mode": mode}
                    (services,), spec = self.serve_case(case, 1, **given)
                    with self.subTest(case.name, mode=mode):
                        self.check_all(case, lambda s=services, p=spec: Batch(p, s), scripts)
                    self.doCleanups()

    def test_a_bag_of_one_walker(self):
        """The program replay repeats every episode and compares its bits with the recorded."""
        scripts = [script for script in SCRIPTS if not has_states(script)]
        for case in CASES.values():
            folder = tempfile.TemporaryDirectory()
            self.addCleanup(folder.cleanup)
            bag = os.path.join(folder.name, "walk.bag")
            services, spec = self.serve_case(case, NUM_WALKERS)
            topics = [f"/walker_{walker}/episode_record" for walker in ALL]
            recorder = self.start_recorder(bag, *topics)
            for each, topic in zip(services, topics):
                wait_for(lambda s=each.server, t=topic: t in recorded_topics(s), topic)
            lines = []
            for script in scripts:
                walkers = Singles(spec, services)
                for walker in ALL:
                    walkers.set_world(walker, "gymnasium")
                lines += itertools.chain(*play(SCRIPTS[script], case, walkers))
            walkers.reset(ALL)  # publishes the records of the last episodes
            self.stop_recorder(recorder)
            status, text, _ = run_program("replay", bag)
            kinds = Counter(re.match("step|reset failed|reset", line)[0] for line in lines)
            with self.subTest(case.name):
                self.assertEqual(status, 0)
                counts = f"{kinds['reset']} episodes equal to the bit ({kinds['step']} steps)"
                self.assertRegex(text.splitlines()[-1], f"^{re.escape(counts)}")
            self.doCleanups()
