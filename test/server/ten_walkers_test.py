"""Several walkers of both engines on one master and one /clock: launch/ten_walkers.launch."""

import os
import signal
import statistics
import time

import rosgraph
import rospy
from bare_ros import wait_for_service
from node_processes import pid_of
from processes import CALLER, Launched, wait_for
from rosgraph_msgs.msg import Clock
from server_harness import ServerTest, publishers_of
from std_srvs.srv import Trigger
from walker_sim.msg import Transition
from walker_sim.srv import GetSpec

WALKERS = [f"/walker_{number}" for number in range(1, 11)]
OWNER, *FOLLOWERS = WALKERS
MAX_DT = 20_000_000  # [ns] dt of BipedalWalker
SECOND = 10**9
MIN_MESSAGES = 60  # at least 0.48 s of simulation time


def node(walker):
    return f"{walker}/walker_sim"


class TenWalkersTest(ServerTest):
    """All tests share one launch."""

    @classmethod
    def setUpClass(cls):
        cls.launched = Launched("ten_walkers.launch", "agent:=random", "rviz:=false")

    @classmethod
    def tearDownClass(cls):
        """Ends the launch: no process and no registration is left."""
        pids = cls.launched.pids()
        assert len(pids) >= 2 * len(WALKERS), "servers and agents"
        assert cls.launched.stop() == 0, cls.launched.output()
        left = [pid for pid in pids if os.path.exists(f"/proc/{pid}")]
        assert not left, cls.launched.output()
        for names in rosgraph.Master(CALLER).getSystemState():
            for name, nodes in names:
                assert not any("/walker_" in node for node in nodes), f"{name} of {nodes}"

    def setUp(self):
        """Records all transitions and /clock."""
        for walker in WALKERS:
            wait_for_service(f"{node(walker)}/get_spec", self.launched)
        self.clock = self.record("/clock", Clock)
        self.transitions = {w: self.record(f"{w}/transition", Transition) for w in WALKERS}
        for recorder in self.transitions.values():
            recorder.wait_count(MIN_MESSAGES)

    def stamps(self, walker):
        return self.transitions[walker].stamps()

    def now(self):
        return self.clock.messages()[-1].clock.to_nsec()

    def assert_they_step(self, walkers=WALKERS):
        counts = {walker: len(self.stamps(walker)) for walker in walkers}
        for walker, count in counts.items():
            self.transitions[walker].wait_count(count + MIN_MESSAGES)

    def assert_time_only_grows(self):
        stamps = self.clock.stamps()
        self.assertEqual(stamps, sorted(stamps))
        for walker in WALKERS:
            stamps = self.stamps(walker)
            self.assertTrue(all(a < b for a, b in zip(stamps, stamps[1:])), walker)

    def pause(self):
        """Pauses all by pausing the owner. Returns the time of /clock and each walker's stamp."""
        pause = rospy.ServiceProxy(f"{node(OWNER)}/pause", Trigger)
        self.assertTrue(pause().success)
        for walker in WALKERS:
            wait_for(
                lambda w=walker: self.now() - MAX_DT < self.stamps(w)[-1],
                f"{walker} to arrive where the clock stands",
            )
        time.sleep(0.3)  # a walker that ignored /clock would run ahead
        return self.now(), {walker: self.stamps(walker)[-1] for walker in WALKERS}

    def unpause(self):
        rospy.ServiceProxy(f"{node(OWNER)}/unpause", Trigger)()

    def test_all_walk_on_one_clock(self):
        specs = {w: rospy.ServiceProxy(f"{node(w)}/get_spec", GetSpec)().spec for w in WALKERS}
        self.assertEqual({spec.engine for spec in specs.values()}, {"Box2D", "MuJoCo"})
        self.assertEqual(len({spec.id for spec in specs.values()}), 6)
        self.assertEqual(publishers_of("/clock"), [node(OWNER)])
        for walker, recorder in self.transitions.items():
            recorder.wait(lambda m: any(m.action), f"an action of {walker}'s agent")

    def test_all_advance_at_one_rate_and_none_is_ahead(self):
        begin, first = self.pause()
        counts = {walker: len(self.stamps(walker)) for walker in WALKERS}
        self.unpause()
        self.assert_they_step()
        self.assert_they_step()
        end, last = self.pause()
        self.unpause()
        self.assertGreater(end - begin, SECOND)
        for walker in WALKERS:
            for now, stamp in ((begin, first[walker]), (end, last[walker])):
                self.assertLessEqual(stamp, now, f"{walker} is ahead of /clock")
                self.assertGreater(stamp, now - MAX_DT, f"{walker} lags behind /clock")
            new = self.stamps(walker)[counts[walker] - 1 :]
            dt = statistics.mode(b - a for a, b in zip(new, new[1:]))
            spec = rospy.ServiceProxy(f"{node(walker)}/get_spec", GetSpec)().spec
            self.assertEqual(dt, round(spec.dt * SECOND), walker)
            # On a busy machine a walker may skip steps, but never most of them.
            self.assertGreater(len(new) * dt, (end - begin) / 2, walker)
        self.assert_time_only_grows()

    def test_killed_follower_does_not_affect_the_others(self):
        killed = FOLLOWERS[5]
        pids = {walker: pid_of(node(walker)) for walker in WALKERS}
        os.kill(pids[killed], signal.SIGKILL)
        self.assert_they_step([walker for walker in WALKERS if walker != killed])
        self.assert_they_step([killed])
        for walker in WALKERS:
            same = pid_of(node(walker)) == pids[walker]
            self.assertEqual(same, walker != killed, walker)
        self.assert_time_only_grows()

    def test_time_stops_while_the_owner_is_down(self):
        pids = {walker: pid_of(node(walker)) for walker in WALKERS}
        # While roslaunch is halted, it does not respawn the owner.
        with self.launched.halted():
            os.kill(pids[OWNER], signal.SIGKILL)
            time.sleep(1)  # for messages in flight
            rest = {walker: self.stamps(walker)[-1] for walker in FOLLOWERS}
            time.sleep(1)  # a follower that did not wait for /clock would step
            self.assertEqual({walker: self.stamps(walker)[-1] for walker in FOLLOWERS}, rest)
        wait_for(lambda: pid_of(node(OWNER)) not in (None, pids[OWNER]), "the owner's restart")
        self.assert_they_step()
        for walker in FOLLOWERS:
            self.assertEqual(pid_of(node(walker)), pids[walker], f"{walker} has ended")
        self.assert_time_only_grows()
