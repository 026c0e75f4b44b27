#!/usr/bin/python3
"""Walker2d's camera: picture, camera_info and TF are consistent."""

import colorsys
import struct
import sys

import rospy
import rostest
from bare_ros import wait_for
from geometry_msgs.msg import Quaternion, Vector3
from sensor_msgs.msg import CameraInfo, Image
from server_harness import ServerTest, nanoseconds
from tf2_msgs.msg import TFMessage
from walker_sim.srv import Render, Reset, Step

SKIN = colorsys.rgb_to_hsv(0.8, 0.6, 0.4)[0]  # the torso's hue in the model
RADIUS = 0.05  # of the torso's capsule [m]
FREE_CAMERA = {"camera_name": "", "camera_lookat": [0.3, 0.0, 1.0], "camera_azimuth": 60.0}


def rotate(q, v):
    """Rotates `v` by the unit quaternion `q`."""

    def cross(a, b):
        return Vector3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)

    once = cross(q, v)
    twice = cross(q, Vector3(once.x + q.w * v.x, once.y + q.w * v.y, once.z + q.w * v.z))
    return Vector3(v.x + 2 * twice.x, v.y + 2 * twice.y, v.z + 2 * twice.z)


def seen_from(camera, point):
    """Transforms a point from odom to the camera's frame. `camera` is its pose in odom."""
    t, q = camera.translation, camera.rotation
    inverse = Quaternion(-q.x, -q.y, -q.z, q.w)
    return rotate(inverse, Vector3(point.x - t.x, point.y - t.y, point.z - t.z))


def project(info, point):
    """Column and row of a point in the camera's frame."""
    column = info.K[0] * point.x / point.z + info.K[2]
    row = info.K[4] * point.y / point.z + info.K[5]
    return round(column), round(row)


def hue(image, column, row):
    at = row * image.step + 3 * column
    hue, saturation, _ = colorsys.rgb_to_hsv(*(value / 255 for value in image.data[at : at + 3]))
    return hue if saturation > 0.1 else None


class Walker2dCameraTest(ServerTest):
    def serve(self, **parameters):
        super().serve(env="Walker2d-v5", mode="lockstep", **parameters)
        self.reset, self.step = self.server.client("reset", Reset), self.server.client("step", Step)
        self.render = self.server.client("render", Render)
        for client in (self.reset, self.step, self.render):
            self.addCleanup(client.close)
        self.begin()

    def begin(self):
        return self.reset(has_seed=True, seed=1).success

    def advance(self):
        return nanoseconds(self.step(action=[0.3, -0.2, 0.1, -0.3, 0.2, 0.1]).transition)

    def watch(self):
        self.images, self.infos = (
            self.record("/camera/image_raw", Image),
            self.record("/camera/camera_info", CameraInfo),
        )
        self.transforms = self.record("/tf", TFMessage)
        wait_for(
            lambda: self.begin() and self.images.messages() and self.infos.messages(),
            "the first picture",
        )

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
        return seen_from(self.transform("camera", stamp), trunk)

    def test_the_torso_is_where_tf_and_camera_info_say(self):
        for camera in ({}, FREE_CAMERA, {"camera_width": 200, "camera_height": 120}):
            self.serve(camera_rate=0.0, **camera)
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
                told = hue(image, column, row)
                self.assertIsNotNone(told, (column, row))
                self.assertAlmostEqual(told, SKIN, delta=0.05, msg=(column, row))
                # 0.6 m beside the torso, at a distance of 4 m, there is no walker.
                beside = min(size[0] - 1, column + round(0.6 * info.K[0] / 4))
                other = hue(image, beside, row)
                self.assertTrue(other is None or abs(other - SKIN) > 0.05, (beside, row))
            self.server.stop()

    def test_depth_is_that_of_the_torso(self):
        self.serve(camera_rate=0.0)
        self.watch()
        stamp = self.advance()
        info, torso = self.infos.at(stamp), self.torso(stamp)
        reply = self.render(encoding="32FC1")
        self.assertTrue(reply.success, reply.status_message)
        self.assertEqual(nanoseconds(reply.image), stamp)
        self.assertEqual((reply.image.encoding, reply.image.step), ("32FC1", 4 * 480))
        self.assertEqual(len(reply.image.data), 4 * 480 * 480)
        column, row = project(info, torso)
        (depth,) = struct.unpack_from("<f", reply.image.data, row * reply.image.step + 4 * column)
        self.assertAlmostEqual(depth, torso.z - RADIUS, delta=0.02)

    def test_the_parameters_of_a_request_move_the_camera(self):
        self.serve()
        images = set()
        for names, values in (
            ([], []),
            (["camera_name"], [""]),
            (["name"], [""]),
            (["camera_name", "camera_distance"], ["", "8"]),
            (["camera_name", "lookat"], ["", "[0, 0, 0.5]"]),
        ):
            reply = self.render(parameter_names=names, parameter_values=values)
            if names == ["name"]:
                self.assertIn("unknown", reply.status_message)
                continue
            self.assertTrue(reply.success, reply.status_message)
            images.add(reply.image.data)
        self.assertEqual(len(images), 4)

    def test_a_camera_that_the_model_has_not_is_named(self):
        self.serve(camera_name="nowhere")
        reply = self.render()
        self.assertFalse(reply.success)
        self.assertIn("nowhere", reply.status_message)


if __name__ == "__main__":
    rospy.init_node("walker2d_camera_test")
    rostest.rosrun("walker_sim", "walker2d_camera_test", Walker2dCameraTest, sys.argv)
