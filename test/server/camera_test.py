#!/usr/bin/python3
"""Camera topics: when the server draws a picture, and the contents of the messages."""

import sys

import rospy
import rostest
from bare_ros import wait_for
from sensor_msgs.msg import CameraInfo, Image
from server_harness import DT, ServerTest, first_stamp, nanoseconds
from tf2_msgs.msg import TFMessage
from walker_sim.msg import Transition
from walker_sim.srv import Reset, Step

STAND = [1.0, 1.0, -1.0, 1.0]  # the walker stands astride for thousands of steps
IMAGE, INFO = "/camera/image_raw", "/camera/camera_info"


def tells_of_camera(message):
    return message.transforms[0].child_frame_id == "camera"


class CameraTest(ServerTest):
    def lockstep(self, **parameters):
        self.serve(mode="lockstep", max_episode_steps=0, **parameters)
        self.reset, self.step = self.server.client("reset", Reset), self.server.client("step", Step)
        for client in (self.reset, self.step):
            self.addCleanup(client.close)
        self.last = self.reset(has_seed=True, seed=1).transition

    def advance(self):
        """Steps. Returns the new stamp [ns]."""
        self.last = self.step(action=STAND).transition
        return nanoseconds(self.last)

    def watch(self):
        """Records pictures, and steps until the first one arrives."""
        images = self.record(IMAGE, Image)
        wait_for(lambda: self.advance() and images.messages(), "the first picture")
        return images

    def maps(self):
        with open(f"/proc/{self.server.pid}/maps", encoding="utf-8") as maps:
            return maps.read()

    def test_nothing_is_drawn_and_nothing_loaded_unless_somebody_subscribes(self):
        self.lockstep(camera_rate=0.0)
        for _ in range(200):
            self.advance()
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
        for _ in range(20):
            self.advance()
        return self.counter("pictures") == before

    def test_pictures_come_at_the_rate(self):
        # Periods are in states of 20 ms; None is the default rate.
        for rate, periods in ((0.0, 1), (None, 2), (10.0, 5), (1 / 0.03, 1.5)):
            self.lockstep(**({} if rate is None else {"camera_rate": rate}))
            images = self.watch()
            due, before = [], nanoseconds(self.last)
            begin = before
            for _ in range(30):
                stamp = self.advance()
                if stamp // (periods * DT) != before // (periods * DT):
                    due.append(stamp)
                    images.at(stamp)  # the next picture could replace it in the queue
                before = stamp
            told = [nanoseconds(image) for image in images.messages()]
            self.assertEqual([stamp for stamp in told if stamp > begin], due, f"rate {rate}")
            self.assertAlmostEqual(len(due), 30 / periods, delta=1)
            self.server.stop()

    def test_each_stamp_is_told_once_by_image_info_and_tf(self):
        self.serve(real_time_factor=4.0, camera_rate=0.0, camera_width=90, camera_height=60)
        infos, transforms = self.record(INFO, CameraInfo), self.record("/tf", TFMessage)
        transitions = self.record("/transition", Transition)
        infos.wait()  # the server may register a subscription later than the subscriber
        transforms.wait(tells_of_camera)
        transitions.wait()
        images = self.record(IMAGE, Image)
        images.wait_count(100)
        first, last = (nanoseconds(images.messages()[i]) for i in (0, -1))
        infos.at(last)
        transforms.wait(lambda m: tells_of_camera(m) and first_stamp(m) >= last)
        poses = filter(tells_of_camera, transforms.messages())

        def stamps(messages):
            return [s for s in map(first_stamp, messages) if first <= s <= last]

        told = stamps(images.messages())
        self.assertEqual(told, sorted(set(told)))
        # Every picture has an info and a transform, but a newer picture may replace a queued one.
        for others in (infos.messages(), poses):
            others = stamps(others)
            self.assertEqual(others, sorted(set(others)))
            self.assertLessEqual(set(told), set(others))
        transitions.at(last)
        self.assertLessEqual(set(told), set(stamps(transitions.messages())))
        self.assert_consecutive(transitions.messages())

    def test_the_picture_is_that_of_the_state(self):
        self.lockstep(camera_rate=0.0, camera_width=90, camera_height=60)
        images, infos = self.watch(), self.record(INFO, CameraInfo)
        for _ in range(5):
            image = images.at(self.advance())
            wanted = self.call("render")
            self.assertTrue(wanted.success, wanted.status_message)
            self.assertEqual(image.header.stamp, wanted.image.header.stamp)
            self.assertEqual((image.width, image.height, image.step), (90, 60, 270))
            self.assertEqual((image.encoding, image.header.frame_id), ("rgb8", "camera"))
            self.assertEqual(image.data, wanted.image.data)
            self.assertGreater(len(set(image.data)), 3)
        info = infos.at(nanoseconds(image))
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


if __name__ == "__main__":
    rospy.init_node("camera_test")
    rostest.rosrun("walker_sim", "camera_test", CameraTest, sys.argv)
