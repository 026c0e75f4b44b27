"""Servers of both engines on one master, separated by namespace and tf_prefix."""

import time

import rosgraph
import rospy
import tf2_msgs.msg
import visualization_msgs.msg
from server_harness import ServerTest, nanoseconds
from walker_sim.srv import Reset, Step

BIPEDAL_WALKER = ["hull", "upper_leg_1", "lower_leg_1", "upper_leg_2", "lower_leg_2", "lidar"]
WALKER2D = ["torso", "thigh", "leg_hinge", "foot_hinge"]
WALKER2D += ["thigh_left", "leg_left_hinge", "foot_left_hinge", "lidar"]
# Frames in each server's /tf, the trunk first. FIXED: frames in /tf_static.
FRAMES = {"/one": BIPEDAL_WALKER, "/two": BIPEDAL_WALKER, "/three": WALKER2D}
FIXED = {"/one": ["base_link"], "/two": ["base_link"]}
FIXED["/three"] = ["base_link", "leg", "foot", "leg_left", "foot_left"]
PREFIXES = {"/one": "left/", "/two": "right/", "/three": "middle/"}  # /two's tf_prefix is /right/


class NamespacesTest(ServerTest):
    def setUp(self):
        self.tf = self.record("/tf", tf2_msgs.msg.TFMessage)

    def proxies(self, space):
        proxies = []
        for name, kind in (("reset", Reset), ("step", Step)):
            rospy.wait_for_service(f"{space}/walker_sim/{name}", timeout=30)
            proxies.append(rospy.ServiceProxy(f"{space}/walker_sim/{name}", kind))
        return proxies

    def reset(self, space, seed=1):
        reply = self.proxies(space)[0](has_seed=True, seed=seed)
        self.assertTrue(reply.success, reply.status_message)
        return reply.transition

    def step(self, space):
        reply = self.proxies(space)[1]([0.0] * (6 if space == "/three" else 4))
        self.assertTrue(reply.success, reply.status_message)
        return reply.transition

    def test_namespace_separates_all_names(self):
        publishers, subscribers, services = rosgraph.Master("/namespaces_test").getSystemState()
        allowed = {"/tf", "/tf_static", "/clock", "/rosout", "/diagnostics"}
        for space in FRAMES:
            node = f"{space}/walker_sim"
            published = {topic for topic, nodes in publishers if node in nodes}
            for topic in published - allowed:
                self.assertTrue(topic.startswith(f"{space}/"), topic)
            self.assertIn(f"{space}/transition", published)
            self.assertIn(f"{space}/scan", published)
            subscribed = {topic for topic, nodes in subscribers if node in nodes}
            self.assertIn(f"{space}/effort_command", subscribed)
            served = {service for service, nodes in services if node in nodes}
            for service in served:
                self.assertTrue(service.startswith(f"{node}/"), service)
        self.assertEqual(dict(publishers)["/clock"], ["/one/walker_sim"])

    def frames_of(self, space, prefix):
        """Checks the frames of a state's transforms and markers."""
        self.reset(space, 2)
        stamp = nanoseconds(self.step(space))
        transforms = self.tf.wait(
            lambda m: (
                m.transforms[0].header.frame_id == f"{prefix}odom"
                and nanoseconds(m.transforms[0]) == stamp
            ),
            "the transforms",
        ).transforms
        self.assertEqual(
            {t.child_frame_id for t in transforms}, {prefix + link for link in FRAMES[space]}
        )
        for transform in transforms:
            self.assertTrue(transform.header.frame_id.startswith(prefix))
            self.assertNotIn("//", transform.header.frame_id + transform.child_frame_id)
        markers = self.record(f"{space}/scene_markers", visualization_msgs.msg.MarkerArray)
        for marker in markers.wait().markers:
            if marker.action == marker.ADD:
                self.assertTrue(marker.header.frame_id.startswith(prefix), marker.header.frame_id)

    def test_frames_have_the_prefix_and_no_leading_slash(self):
        for space, prefix in PREFIXES.items():
            self.frames_of(space, prefix)

    def test_frames_of_all_servers_are_distinct(self):
        for space in FRAMES:
            self.reset(space)
        time.sleep(0.2)
        parents = {}
        for message in self.tf.messages():
            for transform in message.transforms:
                known = parents.setdefault(transform.child_frame_id, transform.header.frame_id)
                self.assertEqual(known, transform.header.frame_id)
        static = self.record("/tf_static", tf2_msgs.msg.TFMessage)
        static.wait_count(len(FRAMES))
        fixed = [t for message in static.messages() for t in message.transforms]
        expected = [PREFIXES[space] + link for space in FRAMES for link in FIXED[space]]
        self.assertEqual(sorted(t.child_frame_id for t in fixed), sorted(expected))
        for transform in fixed:
            self.assertNotIn(transform.child_frame_id, parents)
            prefix = transform.child_frame_id.split("/")[0]
            self.assertEqual(transform.header.frame_id.split("/")[0], prefix)
