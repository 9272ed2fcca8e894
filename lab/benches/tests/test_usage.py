"""The resource usage of processes."""

import os
import unittest

from harness.usage import usage_of


class UsageOfProcesses(unittest.TestCase):
    def test_work_shows_as_cpu_seconds(self):
        before = usage_of(os.getpid())
        while usage_of(os.getpid()).cpu_seconds < before.cpu_seconds + 0.02:
            sum(range(10_000))
        self.assertGreater(before.resident_bytes, 1 << 20)

    def test_a_process_that_has_ended_has_nothing(self):
        child = os.fork()
        if child == 0:
            os._exit(0)
        os.waitpid(child, 0)
        self.assertEqual(usage_of(child).resident_bytes, 0)


if __name__ == "__main__":
    unittest.main()
