"""The simulation agrees with queueing theory."""

import random
import unittest

import scaling


class Queues(unittest.TestCase):
    """Of frames before replicas."""

    def test_one_replica_waits_as_pollaczek_and_khinchine_say(self):
        # Poisson arrivals, constant service: the mean wait is load * service / (2 * (1 - load)).
        chance = random.Random(1)
        service, load = 0.01, 0.7
        times, at = [], scaling.WARM_UP_SECONDS
        for _ in range(400_000):
            at += chance.expovariate(load / service)
            times.append(at)
        for balancer in scaling.BALANCERS:
            seen = scaling.latencies(times, service, 1, balancer, chance)
            wait = sum(seen) / len(seen) - service
            expected = load * service / (2 * (1 - load))
            self.assertAlmostEqual(wait, expected, delta=0.05 * expected)

    def test_frames_that_come_one_by_one_never_wait(self):
        times = [scaling.WARM_UP_SECONDS + 0.5 * turn for turn in range(100)]
        seen = scaling.latencies(times, 0.5, 1, "in turns", random.Random(1))
        self.assertAlmostEqual(max(seen), 0.5)

    def test_knowing_who_is_done_first_never_needs_more_replicas(self):
        counts = {balancer: scaling.needed(300, 0.04, balancer) for balancer in scaling.BALANCERS}
        self.assertLessEqual(counts["first done"], counts["in turns"])
        self.assertLessEqual(counts["in turns"], counts["random"])
        self.assertGreaterEqual(counts["first done"], 300 * 0.04)

    def test_a_frame_that_is_slower_than_the_target_alone_is_refused(self):
        with self.assertRaisesRegex(ValueError, "a frame alone takes"):
            scaling.needed(10, 2 * scaling.TARGET_SECONDS, "random")
