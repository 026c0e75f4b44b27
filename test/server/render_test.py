#!/usr/bin/python3
"""~render: environments, sizes, refusals, and other clients meanwhile."""

import signal
import socket
import struct
import sys
import threading

import rosgraph_msgs.msg
import rospy
import rostest
from sensor_msgs.msg import Image
from server_harness import ServerTest, bits, nanoseconds
from walker_sim.srv import Render, Reset, ResetBatch, Step, StepBatch

STAND = [1.0, 1.0, -1.0, 1.0]  # the walker stands astride for thousands of steps
BIG = {"parameter_names": ["width", "height"], "parameter_values": ["4096", "4096"]}
PROMPT = 20  # wall seconds; more than a clean exit takes


class RenderTest(ServerTest):
    def serve(self, **parameters):
        parameters.setdefault("mode", "lockstep")
        parameters.setdefault("max_episode_steps", 0)
        super().serve(**parameters)
        self.render = self.client("render", Render)

    def client(self, name, kind):
        client = self.server.client(name, kind)
        self.addCleanup(client.close)
        return client

    def begin(self, seed=1):
        self.reset, self.step = self.client("reset", Reset), self.client("step", Step)
        self.last = self.reset(has_seed=True, seed=seed).transition

    def assert_serves(self, steps=5):
        for _ in range(steps):
            reply = self.step(action=STAND)
            self.assertTrue(reply.success, reply.status_message)
            self.assertEqual(reply.transition.step, self.last.step + 1)
            self.last = reply.transition

    def picture(self, **fields):
        reply = self.render(**fields)
        self.assertTrue(reply.success, reply.status_message)
        self.assertEqual(reply.status_message, "")
        return reply.image

    def refusal(self, **fields):
        reply = self.render(**fields)
        self.assertFalse(reply.success)
        self.assertEqual((reply.image.width, reply.image.data), (0, b""))
        return reply.status_message

    def test_the_picture_of_now(self):
        self.serve()
        self.begin()
        images = []
        for _ in range(3):
            self.assert_serves(5)
            image = self.picture()
            self.assertEqual((image.width, image.height, image.step), (600, 400, 1800))
            self.assertEqual((image.encoding, image.is_bigendian), ("rgb8", 0))
            self.assertEqual(len(image.data), 600 * 400 * 3)
            self.assertEqual(nanoseconds(image), nanoseconds(self.last))
            self.assertEqual(self.picture(encoding="rgb8").data, image.data)
            images.append(image.data)
        self.assertEqual(len(set(images)), 3)

    def test_parameters_take_the_place_of_the_server_s(self):
        self.serve(camera_width=90, camera_height=60)
        self.begin()
        sizes = (
            ([], [], (90, 60)),
            (["width"], ["30"], (30, 60)),
            (["camera_height", "width"], ["20", "30"], (30, 20)),
        )
        for names, values, size in sizes:
            image = self.picture(parameter_names=names, parameter_values=values)
            self.assertEqual((image.width, image.height), size)
            self.assertEqual(len(image.data), 3 * size[0] * size[1])

    def test_many_sizes_one_after_the_other(self):
        self.serve()
        self.begin()
        for width in [*range(1, 30), *range(1, 30)]:
            image = self.picture(parameter_names=["width"], parameter_values=[str(width)])
            self.assertEqual(image.width, width)

    def test_free_running_the_clock_goes_on(self):
        self.serve(mode="free", max_episode_steps=1600)
        clock = self.record("/clock", rosgraph_msgs.msg.Clock)
        stamps = [nanoseconds(self.picture()) for _ in range(20)]
        self.assertEqual(stamps, sorted(stamps))
        for stamp in stamps[5:]:
            clock.at(stamp)
        self.call("pause")
        before = self.picture()
        self.assertEqual(self.picture().data, before.data)

    def test_any_of_many_environments(self):
        self.serve(num_envs=3)
        reset, step = self.client("reset_batch", ResetBatch), self.client("step_batch", StepBatch)
        self.assertIn("no episode", self.refusal(environment=2))
        reset(environments=[0, 2], has_seed=[1, 1], seeds=[4, 6])
        self.assertIn("no episode", self.refusal(environment=1))
        self.assertTrue(self.picture(environment=2).data)
        reset(has_seed=[1, 1, 1], seeds=[4, 5, 6])
        for _ in range(30):
            self.assertTrue(step(actions=STAND * 3).success)
        many = [self.picture(environment=i).data for i in range(3)]
        refusal = self.refusal(environment=3)
        self.assertEqual(refusal, "environment = 3; must be below num_envs = 3")
        self.assertEqual(len(set(many)), 3)
        self.server.stop()
        self.serve()
        for seed, data in zip((4, 5, 6), many):
            self.begin(seed)
            self.assert_serves(30)
            self.assertEqual(self.picture().data, data)

    def test_refusals_name_what_is_wrong(self):
        self.serve()
        self.assertIn("no episode", self.refusal())
        self.begin()
        cases = (
            ({"environment": 1}, ["environment = 1", "num_envs = 1"]),
            ({"encoding": "bgr8"}, ["encoding = bgr8", "rgb8 or 32FC1"]),
            ({"encoding": "32FC1"}, ["depth"]),
            ({"parameter_names": ["width"]}, ["parameter_names has 1", "parameter_values 0"]),
            (self.given("heigth", "3"), ["heigth", "unknown", "height"]),
            (self.given("camera_heigth", "3"), ["camera_heigth", "unknown"]),
            (self.given("camera_rate", "3"), ["camera_rate", "unknown"]),
            (self.given("width", "0"), ["width = 0", "[1, 4096]"]),
            (self.given("width", "4097"), ["width = 4097", "[1, 4096]"]),
            (self.given("width", "wide"), ["width = wide", "integer"]),
            (self.given("", "3"), ["NAME=VALUE"]),
        )
        for fields, words in cases:
            text = self.refusal(**fields)
            for word in words:
                self.assertIn(word, text)
        self.assert_serves()
        self.assertTrue(self.picture().data)

    @staticmethod
    def given(name, value):
        return {"parameter_names": [name], "parameter_values": [value]}

    def test_many_clients_at_once_and_steps_meanwhile(self):
        self.serve()
        self.begin()
        stamps, failures = [], []

        def watch(client):
            try:
                for _ in range(5):
                    reply = client()
                    assert reply.success, reply.status_message
                    stamps.append(nanoseconds(reply.image))
            except Exception as error:
                failures.append(error)

        clients = [self.client("render", Render) for _ in range(20)]
        watchers = [threading.Thread(target=watch, args=(client,)) for client in clients]
        for watcher in watchers:
            watcher.start()
        told = {nanoseconds(self.last)}
        while any(watcher.is_alive() for watcher in watchers):
            self.assert_serves(1)
            told.add(nanoseconds(self.last))
        for watcher in watchers:
            watcher.join()
        self.assertEqual(failures, [])
        self.assertEqual(len(stamps), 100)
        self.assertLessEqual(set(stamps), told)

    def test_requests_in_one_piece_are_answered_in_order(self):
        self.serve()
        self.begin()
        client = self.server.client("render", Render)
        sizes = ["50", "20", "70"]
        client.connection.sendall(
            b"".join(client.request_bytes(**self.given("width", size)) for size in sizes)
        )
        for size in sizes:
            self.assertEqual(client.receive().image.width, int(size))
        client.close()

    def test_a_connection_for_one_picture(self):
        self.serve()
        self.begin()
        proxy = rospy.ServiceProxy("/walker_sim/render", Render)
        for _ in range(3):
            self.assertTrue(proxy().success)

    def test_clients_that_vanish(self):
        self.serve()
        self.begin()
        for reset in (False, True):
            for _ in range(50):
                client = self.server.client("render", Render)
                if reset:  # close() sends an RST
                    linger = struct.pack("ii", 1, 0)
                    client.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
                client.send()
                client.close()
            self.assert_serves()
        self.assertTrue(self.picture().data)

    def test_who_does_not_read_holds_nobody_up(self):
        self.serve()
        self.begin()
        clients = [self.server.client("render", Render) for _ in range(3)]
        for client in clients:
            client.send(**BIG)
        self.assert_serves(50)
        self.assertTrue(self.picture().data)
        for client in clients:
            client.close()
        self.assert_serves()

    def test_an_end_amid_pictures(self):
        for end in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            self.serve()
            self.begin()
            clients = [self.server.client("render", Render) for _ in range(4)]
            for client in clients:
                client.send(**BIG)
            self.assert_serves()  # by then it has read the requests
            if end == signal.SIGKILL:
                self.server.kill()
            else:
                self.assertEqual(self.server.stop(end, PROMPT), 0, self.server.output())
            for client in clients:
                with self.assertRaises(OSError):
                    while True:
                        client.receive()
                client.close()

    def test_a_trajectory_is_the_same_with_pictures_and_without(self):
        for env, action in (("BipedalWalkerHardcore-v3", STAND), ("Walker2d-v5", [0.1] * 6)):
            told = []
            for watched in (False, True):
                self.serve(env=env, camera_rate=0.0)
                if watched:
                    self.record("/camera/image_raw", Image)
                self.begin()
                episode = [self.last]
                while len(episode) < 100 and not episode[-1].terminated:
                    episode.append(self.step(action=action).transition)
                    if watched:
                        self.assertTrue(self.picture().data)
                told.append([bits([*state.observation, state.reward]) for state in episode])
                self.server.stop()
            self.assertEqual(*told)


if __name__ == "__main__":
    rospy.init_node("render_test")
    rostest.rosrun("walker_sim", "render_test", RenderTest, sys.argv)
