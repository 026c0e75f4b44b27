"""Camera topics and ~render: when pictures are drawn, and their contents.

pictures_test.cpp has concurrent clients and the stamps of image, info and tf;
test/python/as_in_process_ros_test.py compares colours and depths with pictures in process.
"""

import colorsys
import signal

import numpy
import rosgraph_msgs.msg
from geometry_msgs.msg import Vector3
from processes import wait_for
from sensor_msgs.msg import CameraInfo, Image
from server_harness import DT, STAND, ServerTest, bits, nanoseconds
from tf2_msgs.msg import TFMessage

ACTIONS = {
    "BipedalWalker-v3": STAND,
    "BipedalWalkerHardcore-v3": STAND,
    "Walker2d-v5": [0.3, -0.2, 0.1, -0.3, 0.2, 0.1],
}
IMAGE, INFO = "/camera/image_raw", "/camera/camera_info"
BIG = {"parameter_names": ["width", "height"], "parameter_values": ["4096", "4096"]}
MAX_EXIT = 20  # wall seconds; more than a clean exit takes
SKIN = colorsys.rgb_to_hsv(0.8, 0.6, 0.4)[0]  # the torso's hue in the model
FREE_CAMERA = {"camera_name": "", "camera_lookat": [0.3, 0.0, 1.0], "camera_azimuth": 60.0}


def in_camera_frame(camera, point):
    """Transforms a point from odom. `camera` is the camera's pose in odom."""
    t, q = camera.translation, camera.rotation
    axis = [-q.x, -q.y, -q.z]  # of the inverse rotation
    offset = numpy.subtract([point.x, point.y, point.z], [t.x, t.y, t.z])
    once = numpy.cross(axis, offset)
    return Vector3(*(offset + 2 * q.w * once + 2 * numpy.cross(axis, once)))


def project(info, point):
    """Column and row of a point in the camera's frame."""
    column = info.K[0] * point.x / point.z + info.K[2]
    row = info.K[4] * point.y / point.z + info.K[5]
    return round(column), round(row)


def hue(image, column, row):
    at = row * image.step + 3 * column
    hue, saturation, _ = colorsys.rgb_to_hsv(*(value / 255 for value in image.data[at : at + 3]))
    return hue if saturation > 0.1 else None


class CameraTest(ServerTest):
    def lockstep(self, env="BipedalWalker-v3", **parameters):
        parameters.setdefault("max_episode_steps", 0)
        self.serve(env=env, mode="lockstep", **parameters)
        self.action = ACTIONS[env]
        self.reset, self.step = self.client("reset"), self.client("step")
        self.render = self.client("render")
        if parameters.get("num_envs", 1) == 1:
            self.begin()

    def begin(self, seed=1):
        self.last = self.reset(has_seed=True, seed=seed).transition

    def advance(self, steps=1):
        """Steps, and checks that no other client has. Returns the new stamp [ns]."""
        self.assert_serves(steps, self.action)
        return nanoseconds(self.last)

    def picture(self, *names, values=(), **fields):
        reply = self.render(parameter_names=names, parameter_values=values, **fields)
        self.assertEqual((reply.success, reply.status_message), (True, ""))
        return reply.image

    def watch(self):
        """Subscribes, and waits for the first picture."""
        self.images, self.infos = self.record(IMAGE, Image), self.record(INFO, CameraInfo)
        self.transforms = self.record("/tf", TFMessage)

        def have_arrived():
            self.begin()
            return self.images.messages() and self.infos.messages()

        wait_for(have_arrived, "the first picture")

    def maps(self):
        with open(f"/proc/{self.server.pid}/maps", encoding="utf-8") as maps:
            return maps.read()

    def test_nothing_is_drawn_without_subscribers(self):
        self.lockstep(camera_rate=0.0)
        self.advance(200)
        self.assertEqual(self.counter("pictures"), 0)
        self.assertNotIn("libcairo", self.maps())
        for topic, kind in ((IMAGE, Image), (INFO, CameraInfo)):
            recorder = self.record(topic, kind)
            wait_for(lambda recorder=recorder: self.advance() and recorder.messages(), topic)
            recorder.close()
            # The server learns of the unsubscription later.
            wait_for(self.draws_nothing, "the end of the pictures")
            self.assertTrue(self.draws_nothing())
        self.assertIn("libcairo", self.maps())

    def draws_nothing(self):
        before = self.counter("pictures")
        self.advance(20)
        return self.counter("pictures") == before

    def test_camera_rate_sets_the_stamps(self):
        # Periods are in states of 20 ms; None is the default rate.
        for rate, periods in ((0.0, 1), (None, 2), (10.0, 5), (1 / 0.03, 1.5)):
            self.lockstep(**({} if rate is None else {"camera_rate": rate}))
            self.watch()
            due, begin = [], nanoseconds(self.last)
            before = begin
            for _ in range(30):
                stamp = self.advance()
                if stamp // (periods * DT) != before // (periods * DT):
                    due.append(stamp)
                    self.images.at(stamp)  # the next picture could replace it in the queue
                before = stamp
            stamps = [nanoseconds(image) for image in self.images.messages()]
            self.assertEqual([stamp for stamp in stamps if stamp > begin], due, f"rate {rate}")
            self.assertAlmostEqual(len(due), 30 / periods, delta=1)

    def test_topic_has_the_picture_of_render(self):
        self.lockstep(camera_rate=0.0, camera_width=90, camera_height=60)
        self.watch()
        for _ in range(5):
            image = self.images.at(self.advance())
            expected = self.picture()
            self.assertEqual(image.header.stamp, expected.header.stamp)
            self.assertEqual((image.width, image.height, image.step), (90, 60, 270))
            self.assertEqual((image.encoding, image.header.frame_id), ("rgb8", "camera"))
            self.assertEqual(image.data, expected.data)
            self.assertGreater(len(set(image.data)), 3)
        info = self.infos.at(nanoseconds(image))
        self.assertEqual((info.width, info.height), (90, 60))
        # A parallel projection is uncalibrated: K, R and P are 0. But image_saver, by
        # camera_calibration_parsers, requires a distortion model with five coefficients.
        self.assertEqual({*info.K, *info.R, *info.P}, {0.0})
        self.assertEqual((info.distortion_model, list(info.D)), ("plumb_bob", [0.0] * 5))

    def test_names_follow_the_namespace_and_the_prefix(self):
        self.serve("/left/walker_sim", tf_prefix="port", camera_rate=0.0)
        image = self.record("/left/camera/image_raw", Image).wait()
        self.assertEqual(image.header.frame_id, "port/camera")
        info = self.record("/left/camera/camera_info", CameraInfo).wait()
        self.assertEqual(info.header.frame_id, "port/camera")
        transform = self.record("/tf", TFMessage).wait(
            lambda m: m.transforms[0].child_frame_id == "port/camera"
        )
        self.assertEqual(transform.transforms[0].header.frame_id, "port/odom")

    def transform(self, child, stamp):
        message = self.transforms.wait(
            lambda m: (
                m.transforms[0].child_frame_id == child and nanoseconds(m.transforms[0]) == stamp
            ),
            child,
        )
        self.assertEqual(message.transforms[0].header.frame_id, "odom")
        return message.transforms[0].transform

    def torso(self, stamp):
        """Position of the torso in the camera's frame."""
        trunk = self.transform("torso", stamp).translation
        return in_camera_frame(self.transform("camera", stamp), trunk)

    def test_tf_and_camera_info_locate_the_torso(self):
        for camera in ({}, FREE_CAMERA, {"camera_width": 200, "camera_height": 120}):
            self.lockstep("Walker2d-v5", camera_rate=0.0, **camera)
            self.watch()
            for _ in range(20):
                stamp = self.advance()
                image, info = self.images.at(stamp), self.infos.at(stamp)
                size = camera.get("camera_width", 480), camera.get("camera_height", 480)
                self.assertEqual((image.width, image.height), size)
                self.assertEqual((info.width, info.height), size)
                self.assertEqual((info.distortion_model, list(info.D)), ("plumb_bob", [0.0] * 5))
                column, row = project(info, self.torso(stamp))
                self.assertTrue(0 <= column < size[0] and 0 <= row < size[1], (column, row))
                torso_hue = hue(image, column, row)
                self.assertIsNotNone(torso_hue, (column, row))
                self.assertAlmostEqual(torso_hue, SKIN, delta=0.05, msg=(column, row))
                # 0.6 m beside the torso, at a distance of 4 m, there is no walker.
                beside = min(size[0] - 1, column + round(0.6 * info.K[0] / 4))
                other = hue(image, beside, row)
                self.assertTrue(other is None or abs(other - SKIN) > 0.05, (beside, row))

    def test_parameters_of_a_request_move_the_camera(self):
        self.lockstep("Walker2d-v5")
        free = self.picture("camera_name", values=[""]).data
        moved = self.picture("camera_name", "lookat", values=["", "[0, 0, 0.5]"]).data
        self.assertEqual(len({free, moved, self.picture().data}), 3)

    def test_render_draws_the_current_state(self):
        self.lockstep()
        self.advance(5)
        image = self.picture()
        self.assertEqual((image.width, image.height, image.step), (600, 400, 1800))
        self.assertEqual((image.encoding, image.is_bigendian), ("rgb8", 0))
        self.assertEqual(len(image.data), 600 * 400 * 3)
        self.assertEqual(nanoseconds(image), nanoseconds(self.last))
        self.assertEqual(self.picture(encoding="rgb8").data, image.data)

    def test_free_running_time_advances_meanwhile(self):
        self.serve()
        self.render = self.client("render")
        clock = self.record("/clock", rosgraph_msgs.msg.Clock)
        stamps = [nanoseconds(self.picture()) for _ in range(20)]
        self.assertEqual(stamps, sorted(stamps))
        for stamp in stamps[5:]:
            clock.at(stamp)
        self.call("pause")
        self.assertEqual(self.picture().data, self.picture().data)

    def test_render_needs_an_episode_of_the_environment(self):
        self.lockstep(num_envs=3)
        self.client("reset_batch")(environments=[0, 2], has_seed=[1, 1], seeds=[4, 6])
        self.assertIn("no episode", self.render(environment=1).status_message)
        self.assertTrue(self.picture(environment=2).data)

    def test_signals_end_the_server_amid_pictures(self):
        for end in (signal.SIGINT, signal.SIGKILL):
            self.lockstep()
            clients = [self.server.client("render") for _ in range(4)]
            for client in clients:
                client.send(**BIG)
            self.advance(5)  # by then it has read the requests
            if end == signal.SIGKILL:
                self.server.kill()
            else:
                self.assertEqual(self.server.stop(end, MAX_EXIT), 0, self.server.output())
            for client in clients:
                with self.assertRaises(OSError):
                    while True:
                        client.receive()
                client.close()

    def test_pictures_do_not_change_the_trajectory(self):
        for env in ("BipedalWalkerHardcore-v3", "Walker2d-v5"):
            episodes = []
            for is_watched in (False, True):
                self.lockstep(env, camera_rate=0.0)
                if is_watched:
                    self.record(IMAGE, Image)
                    self.begin()
                states = [self.last]
                while len(states) < 100 and not states[-1].terminated:
                    self.advance()
                    states.append(self.last)
                    if is_watched:
                        self.assertTrue(self.picture().data)
                episodes.append([bits([*state.observation, state.reward]) for state in states])
            self.assertEqual(*episodes)
