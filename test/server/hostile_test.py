"""Invalid input to every service and subscribed topic of the server.

The server refuses it with a message that names it, or accepts it as documented. The next valid call
gives bitwise the result of an undisturbed server.
"""

import copy
import io
import itertools
import math
import random
import re
import struct
import sys

from bare_ros import receive_reply, request_bytes
from gazebo_messages import GetPhysicsProperties, SetPhysicsProperties
from geometry_msgs.msg import Vector3
from node_processes import SERVICES, memory
from processes import wait_for
from server_harness import Bytes, ServerTest, bits, nanoseconds, same_experience
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Empty, Trigger
from walker_sim.msg import World, WorldParameter

ALL = {
    **SERVICES,
    "pause": Trigger,
    "unpause": Trigger,
    "pause_physics": Empty,
    "unpause_physics": Empty,
    "reset_simulation": Empty,
    "reset_world": Empty,
    "get_physics_properties": GetPhysicsProperties,
    "set_physics_properties": SetPhysicsProperties,
}
EMPTY = ("get_spec", "get_worlds", "snapshot", "pause", "unpause", "pause_physics")
EMPTY += ("unpause_physics", "reset_simulation", "reset_world", "get_physics_properties")
ACTION = [0.5, -0.25, 1.0, 0.125]
NAN, INF = math.nan, math.inf
MAX_UINT32 = 2**32 - 1
ROWS = ("observations", "rewards", "terminated", "truncated", "steps", "info")
MILLION = 1_000_000
LARGEST = sys.float_info.max
# Finite actions, and the actions that they are clipped to.
EXTREME_ACTIONS = [
    ([5e-324, -5e-324, 2.2e-308, -0.0], [5e-324, -5e-324, 2.2e-308, -0.0]),
    ([1e300, -1e300, LARGEST, -LARGEST], [1.0, -1.0, 1.0, -1.0]),
    ([1.0000000000000002, -7.0, 1e9, 0.5], [1.0, -1.0, 1.0, 0.5]),
]
SHORT, LONG = "ends within a field", "longer than its type"


def request_of(name, fields):
    """The request's bytes after its length."""
    return request_bytes(ALL[name], **fields)[4:]


def physics(time_step=0.02):
    """Fields of a request that changes nothing of a BipedalWalker by its default."""
    return {"time_step": time_step, "gravity": Vector3(0.0, 0.0, -10.0)}


class Caller:
    """Sends arbitrary bytes over one connection per service."""

    def __init__(self, server):
        self._server = server
        self._clients = {}

    def client(self, name):
        if name not in self._clients:
            self._clients[name] = self._server.client(name, ALL[name])
        return self._clients[name]

    def send(self, name, body):
        """Returns the message of a refusal or "", and the response or None."""
        connection = self.client(name).connection
        connection.sendall(struct.pack("<I", len(body)) + body)
        fine, data = receive_reply(connection)
        if not fine:
            return data.decode(), None
        response = ALL[name]._response_class().deserialize(data)
        words = getattr(response, "status_message", getattr(response, "message", ""))
        return ("" if getattr(response, "success", True) else words), response

    def call(self, name, **fields):
        return self.send(name, request_of(name, fields))

    def ask(self, name, **fields):
        words, response = self.call(name, **fields)
        assert words == "", f"{name}: {words}"
        return response

    def close(self):
        for client in self._clients.values():
            client.close()
        self._clients = {}


class HostileTest(ServerTest):
    def serve_two(self, num_envs=1, begins=True, **parameters):
        """Starts a server to disturb and an undisturbed reference with the same seed."""
        self.num_envs = num_envs
        same = {"num_envs": num_envs, "diagnostic_period": 0.05, "seed": "7"}
        self.serve(**{"mode": "lockstep", **same, **parameters})
        same["diagnostic_period"] = 1000.0  # only the disturbed server reports in time
        quiet = self.start("/quiet/walker_sim", mode="lockstep", publish_clock=False, **same)
        quiet.wait_until_it_serves()
        self.troubled, self.quiet = Caller(self.server), Caller(quiet)
        for caller in (self.troubled, self.quiet):
            self.addCleanup(caller.close)
        self.seed, self.offset = 0, None
        if begins:
            self.begin_again()

    def both(self, name, **fields):
        return [caller.ask(name, **fields) for caller in (self.troubled, self.quiet)]

    def begin_again(self):
        """Resets both servers with the next seed, and compares the observations."""
        self.seed, self.offset = self.seed + 1, None
        if self.num_envs == 1:
            one, other = self.both("reset", has_seed=True, seed=self.seed)
            self.assertTrue(same_experience(one.transition, other.transition))
        else:
            seeds = [self.seed + i for i in range(self.num_envs)]
            one, other = self.both("reset_batch", has_seed=[1] * self.num_envs, seeds=seeds)
            self.assertEqual(bits(one.observations), bits(other.observations))

    def assert_untouched(self, what=""):
        """Steps both servers, and compares the replies."""
        if self.num_envs == 1:
            one, other = self.both("step", action=ACTION)
            self.assertTrue(same_experience(one.transition, other.transition), what)
            self.assert_same_time(one.transition, other.transition, what)
            if one.transition.terminated or one.transition.truncated:
                self.begin_again()
        else:
            one, other = self.both("step_batch", actions=ACTION * self.num_envs)
            for name in ROWS:
                rows = [bits(list(getattr(reply, name))) for reply in (one, other)]
                self.assertEqual(*rows, f"{what}: {name}")

    def assert_same_time(self, one, other, what):
        """The servers' times start apart; later they differ by the same offset."""
        offset = nanoseconds(one) - nanoseconds(other)
        self.offset = self.offset or offset
        self.assertEqual(offset, self.offset, f"{what}: time has advanced")

    def assert_refused(self, table):
        """Sends each (service, fields or bytes, pattern); a refusal changes nothing."""
        for name, request, pattern in table:
            body = request if isinstance(request, bytes) else request_of(name, request)
            words, _ = self.troubled.send(name, body)
            what = f"{name} {str(request)[:200]}"
            self.assertRegex(words, pattern, what)
            self.assertLess(len(words), 4500, what)  # 1000 bytes, up to 4 characters each
            self.assertTrue(words.isprintable(), what)
            self.assert_untouched(what)

    def good_requests(self):
        """A valid request for each service with a non-empty request, except ~restore."""
        count = self.num_envs
        return {
            "reset": {"has_seed": True, "seed": 5},
            "step": {"action": ACTION},
            "step_many": {"action": ACTION, "steps": 2},
            "reset_batch": {
                "environments": list(range(count)),
                "has_seed": [1] * count,
                "seeds": list(range(count)),
            },
            "step_batch": {"actions": ACTION * count},
            "set_state": {"position": [0.0] * 7, "velocity": [0.0] * 7},  # refused
            "set_world": {"worlds": [World("gymnasium", [])]},
            "set_real_time_factor": {"factor": 1.0},
            "set_physics_properties": physics(),
            "render": {"parameter_names": ["width"], "parameter_values": ["8"]},
        }

    def check_bytes(self):
        requests = {name: request_of(name, {}) for name in EMPTY}
        for name, fields in self.good_requests().items():
            requests[name] = request_of(name, fields)
        if self.num_envs == 1:
            record = self.troubled.ask("snapshot").record
            requests["restore"] = request_of("restore", {"record": record})
        for name, body in requests.items():
            cuts = sorted({*range(0, len(body), 1 + len(body) // 30), len(body) - 1} - {-1})
            self.assert_refused([(name, body[:size], SHORT) for size in cuts])
            self.assert_refused([(name, body + more, LONG) for more in (b"\0", b"\xff" * 1000)])
            too_long = (
                f"service /walker_sim/{name}: a request of {{}} bytes; at most \\d+ are accepted"
            )
            large = b"\xff" * (51 * MILLION if name == "restore" else MILLION)
            self.assert_refused([(name, large, too_long.format(len(large)))])
            announced = self.server.client(name, ALL[name])
            announced.connection.sendall(struct.pack("<I", MAX_UINT32))
            with self.assertRaisesRegex(RuntimeError, too_long.format(MAX_UINT32)):
                announced.receive()
            announced.close()
            self.assert_untouched(name)

    def test_invalid_bytes(self):
        self.serve_two()
        self.check_bytes()

    def test_invalid_bytes_to_many_walkers(self):
        self.serve_two(num_envs=3)
        self.check_bytes()

    def flip_bits(self, name, body, check=lambda words, response: None):
        """Flips a random bit of each byte, and each bit of the first 16, which contain lengths."""
        chance = random.Random(name)
        flips = [(byte, chance.randrange(8)) for byte in range(len(body))]
        flips += [(byte, bit) for byte in range(min(len(body), 16)) for bit in range(8)]
        for byte, bit in flips:
            flipped = bytearray(body)
            flipped[byte] ^= 1 << bit
            what = f"{name}: bit {bit} of byte {byte}"
            words, response = self.troubled.send(name, bytes(flipped))
            if response is None or not getattr(response, "success", True):
                self.assertNotEqual(words, "", what)
                self.assert_untouched(what)
            else:  # still a valid request
                check(what, response)
                self.begin_again()
                self.assert_untouched(what)

    def test_flipped_bits(self):
        self.serve_two()
        for name, fields in self.good_requests().items():
            self.flip_bits(name, request_of(name, fields))

    def test_flipped_bits_of_a_record(self):
        """An accepted record has bitwise the length and the return of the original.

        A record with another action that gives the same transitions is valid.
        """
        self.serve_two()
        for _ in range(5):
            last = self.both("step", action=ACTION)[0].transition
        record = self.troubled.ask("snapshot").record

        def check(what, response):
            restored = response.transition
            self.assertEqual(restored.step, last.step, what)
            self.assertEqual(bits([restored.episode_return]), bits([last.episode_return]), what)

        self.flip_bits("restore", request_of("restore", {"record": record}), check)

    def test_invalid_values(self):
        self.serve_two()
        actions = [([0.5] * MILLION, "a request of")]
        for size in (0, 3, 5, 8000):
            actions.append(([0.5] * size, rf"action has {size} values; must"))
        joints = enumerate(("hip_1", "knee_1", "hip_2", "knee_2"))
        for (joint, name), value in itertools.product(joints, (NAN, -NAN, INF, -INF)):
            action = [value if i == joint else 0.5 for i in range(4)]
            actions.append((action, rf"action\[{joint}\] \({name}\) = -?(nan|inf); must be finite"))
        table = [("step", {"action": action}, message) for action, message in actions]
        table += [("step_many", {"action": a, "steps": 3}, message) for a, message in actions]
        for steps in (0, 101, MILLION, 2**31, MAX_UINT32):
            request = {"action": ACTION, "steps": steps}
            table.append(("step_many", request, rf"steps = {steps}; must be in \[1, 100\]"))
        self.assert_refused(table)
        self.assert_refused(self.batch_table())
        self.assert_refused(self.render_table())
        factors = (0.0, 1.0, NAN, -INF)
        table = [("set_real_time_factor", {"factor": f}, "in mode lockstep") for f in factors]
        table.append(("set_physics_properties", physics(INF), "time_step = inf"))
        table.append(("unpause_physics", {}, "in lockstep"))
        table.append(("set_state", {}, "BipedalWalker-v3 has no positions and velocities"))
        self.assert_refused(table)

    def batch_table(self):
        count = self.num_envs
        steps = [([0.5] * MILLION, "/step_batch: a request of")]
        for size in (0, 4 * count - 1, 4 * count + 1, 8000):
            steps.append(([0.5] * size, rf"actions? ha(s|ve) {size} values; must"))
        for value, index in itertools.product((NAN, INF, -INF), (0, 4 * count - 1)):
            actions = [value if i == index else 0.5 for i in range(4 * count)]
            steps.append((actions, rf"action\[{index % 4}\] \(\w+\) = -?(nan|inf); must be finite"))
        resets = [
            ({"environments": [0, 0]}, r"environments\[1\] = 0; must be listed once"),
            ({"environments": [0] * MILLION}, "a request of"),
        ]
        table = [
            ("set_world", {"worlds": [World("x" * MILLION, [])]}, "/set_world: a request of"),
            ("set_world", {"worlds": [World("x" * 30_000, [])]}, "preset x+.*bytes left out"),
            ("set_world", {"worlds": [World("\x1b[2J", [])]}, r"preset \\x1b\[2J: unknown"),
        ]
        extremes = (NAN, INF, -INF, 1e308, 5e-324)
        for *ends, is_log in itertools.product(extremes, extremes, (False, True)):
            world = World("", [WorldParameter("gravity", *ends, is_log)])
            table.append(("set_world", {"worlds": [world]}, "gravity"))
        for index in (count, count + 1, 2**31, MAX_UINT32):
            message = rf"= {index}; must be below num_envs = {count}"
            resets.append(({"environments": [0, index]}, rf"environments\[1\] {message}"))
            for name in ("render", "set_state"):
                table.append((name, {"environment": index}, f"environment {message}"))
        for flags, seeds in (
            *((count, 0), (0, count), (count, count - 1), (count, count + 1)),
            *((count + 1, count + 1), (count - 1, count - 1)),
        ):
            if flags == seeds == 0:
                continue  # with one walker both are empty, which is valid
            message = rf"has_seed has {flags} values and seeds {seeds}; both must be empty or"
            resets.append(({"has_seed": [1] * flags, "seeds": [1] * seeds}, message))
        table += [("step_batch", {"actions": actions}, message) for actions, message in steps]
        return table + [("reset_batch", *row) for row in resets]

    def render_table(self):
        def parameter(name, value):
            return {"parameter_names": [name], "parameter_values": [value]}

        rows = [
            ({"encoding": "bgr8"}, "encoding = bgr8; must be rgb8 or 32FC1"),
            ({"encoding": "32FC1"}, "depth"),
            ({"encoding": "\x1b[2J\n" * 5000}, r"encoding = \\x1b\[2J\\n.*bytes left out"),
            ({"encoding": "x" * MILLION}, "/render: a request of"),
            (parameter("x" * MILLION, "1"), "/render: a request of"),
            (parameter("x" * 30_000, "1"), "parameter x+ .*Known: .*width"),
            (parameter("", ""), "must be NAME=VALUE"),
            (parameter("widht", "8"), "parameter widht = 8: unknown; did you mean width"),
            (parameter("camera_rate", "3"), "parameter camera_rate = 3: unknown"),
            ({"parameter_names": ["width"]}, "parameter_names has 1 texts and"),
            ({"parameter_names": [""] * 5000}, "an array has 5000 elements; at most"),
        ]
        for value in ("0", "-1", "4097", "1e9", "nan", ".inf", "ten", "", "8 ", "[8]", "8\n"):
            rows.append((parameter("width", value), "parameter width = .*: must be"))
        twice = {"parameter_names": ["width"] * 2, "parameter_values": ["8"] * 2}
        return [("render", *row) for row in [*rows, (twice, "width: given twice")]]

    def test_invalid_values_of_many_walkers(self):
        self.serve_two(num_envs=3)
        self.assert_refused(self.batch_table())
        self.assert_refused(self.render_table())
        names = ("reset", "step", "step_many", "snapshot", "restore", "reset_simulation")
        words = "is for one environment, and this server has num_envs = 3.*~reset_batch.*~step"
        good = self.good_requests()
        self.assert_refused([(name, good.get(name, {}), words) for name in (*names, "reset_world")])

    def test_extreme_valid_values(self):
        """Actions are clipped as in Gymnasium; seeds span the range of uint64."""
        self.serve_two()
        for action, same in EXTREME_ACTIONS:
            for name, more in (("step", {}), ("step_many", {"steps": 2})):
                one = self.troubled.ask(name, action=action, **more).transition
                other = self.quiet.ask(name, action=same, **more).transition
                self.assertEqual(bits(one.observation), bits(other.observation))
                self.assertEqual(bits([one.reward]), bits([other.reward]))
                self.assertEqual(bits(one.action), bits(action))
        for seed in (0, 1, 2**31, 2**32 - 1, 2**32, 2**63 - 1, 2**63, 2**64 - 1):
            one, other = self.both("reset", has_seed=True, seed=seed)
            self.assertTrue(same_experience(one.transition, other.transition))
            self.assert_untouched(f"seed {seed}")
        request = b"\xff" + struct.pack("<QII", 5, 0, 0)  # non-zero: true; no world
        words, reply = self.troubled.send("reset", request)
        self.assertEqual(words, "")
        other = self.quiet.ask("reset", has_seed=True, seed=5)
        self.assertTrue(same_experience(reply.transition, other.transition))
        self.assert_untouched()

    def test_calls_before_the_first_episode_and_wrong_records(self):
        self.serve_two(begins=False, max_episode_steps=0)
        for name in ("step", "step_many", "step_batch", "snapshot", "render", "set_state"):
            words, _ = self.troubled.call(name, **self.good_requests().get(name, {}))
            self.assertRegex(words, "there is no episode yet", name)
        for caller in (self.troubled, self.quiet):
            caller.ask("reset")  # uses the seed parameter
        self.assert_untouched()
        record = self.troubled.ask("snapshot").record
        for path, value, pattern in (  # test/episode has all refusals of records
            ("episode.length", MAX_UINT32, "actions has 4 values; must have 17179869180"),
            ("episode.length", 0, "actions has 4 values; must have 0"),
            ("spec.id", "\x1b[2J" * 20_000, r"id = \\x1b\[2J"),
            ("spec.id", "\n" * MILLION, r"id = \\n"),
            ("spec.engine", "", "engine =  in the record; here it is Box2D"),
            ("spec.parameter_names", ["a"] * 9, "parameter_values has"),
        ):
            part, name = path.split(".")
            wrong = copy.deepcopy(record)
            setattr(getattr(wrong, part), name, value)
            self.assert_refused([("restore", {"record": wrong}, pattern)])

    def test_free_running_server(self):
        self.serve_two(begins=False, mode="free", real_time_factor=1.0)
        for name, fields, pattern in (
            ("step", {"action": ACTION}, "step: mode is free and the simulation runs; call ~pause"),
            ("step_many", {"action": ACTION, "steps": 1}, "step_many: mode is free"),
            ("step_batch", {"actions": ACTION}, "step_batch: mode is free"),
        ):
            self.assertRegex(self.troubled.call(name, **fields)[0], pattern)
        self.troubled.ask("pause")
        self.begin_again()
        words, wrong = "real_time_factor = .*: must be", (NAN, INF, -INF, -1e-300, 1000.1, 1e308)
        self.assert_refused([("set_real_time_factor", {"factor": f}, words) for f in wrong])
        for factor in (0.0, 5e-324, 1000.0):
            self.troubled.ask("set_real_time_factor", factor=factor)
            self.assert_untouched(f"factor {factor}")

    def test_effort_commands(self):
        """roscpp's own deserializers would allocate the claimed number of elements first."""
        self.serve_two(mode="free", paused=True)
        publisher = self.commander(Bytes)
        good = command(ACTION)
        chance = random.Random(1)
        bad = [command([1.0] * size) for size in (0, 3, 5, 1000, MILLION)]
        bad += [command([value, 0.0, 0.0, 0.0]) for value in (NAN, INF, -INF)]
        bad += [good[:-1], b""]
        claims = [(0, 0, 2**31 - 1), (0, 0, MAX_UINT32)]  # numbers of elements
        claims += [(2**31 - 1, *[0] * 16), (1, 2**31 - 1, *[0] * 16)]  # of dimensions; of letters
        bad += [struct.pack(f"<{len(claim)}I", *claim) for claim in claims]
        bad += [bytes(chance.randrange(256) for _ in range(40)) for _ in range(3)]
        bad += [good + b"\0", bytes(2**20 + 1)]
        before = memory(self.server.pid)
        for count, data in enumerate(bad, start=1):
            publisher.publish(Bytes(data))
            wait_for(lambda n=count: self.counter("refused") == n, f"the refusal of {data[:50]!r}")
            self.assert_untouched(str(data[:50]))
        self.assertLess(memory(self.server.pid) - before, 50 * MILLION)
        for efforts in ([5e-324] * 4, [LARGEST] * 4):  # held until the next step
            publisher.publish(Bytes(command(efforts)))
            self.assert_untouched(str(efforts))
        self.assertEqual(self.counter("refused"), len(bad))
        for data, reason in ((b"", SHORT), (bad[-2], LONG), (bad[-1], "at most 1048576")):
            line = rf"ERROR.*Refused effort command: .*{reason}"

            def is_logged(data=data, line=line):
                publisher.publish(Bytes(data))  # again: the log is throttled
                return re.search(line, self.server.output())

            wait_for(is_logged, reason)


def command(efforts):
    buffer = io.BytesIO()
    Float64MultiArray(data=efforts).serialize(buffer)
    return buffer.getvalue()
