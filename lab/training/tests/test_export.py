"""Tests of the exported weights: shares of changes add up, and unchanged weights are left out."""

import unittest

import numpy as np

try:
    from export import changed_weights, mixed
except ModuleNotFoundError:
    mixed = None

BASE = {"a": np.array([1.0, 2.0], np.float32), "b": np.array([8.0], np.float32)}


@unittest.skipUnless(mixed, "needs lab/training/requirements-train.txt")
class Export(unittest.TestCase):
    def test_unchanged_weights_are_left_out(self):
        self.assertEqual(list(changed_weights(BASE, {"a": BASE["a"] + 1, "b": BASE["b"]})), ["a"])

    def test_shares_of_several_changes_add_up(self):
        one = changed_weights(BASE, {"a": BASE["a"] + 1, "b": BASE["b"]})
        other = changed_weights(BASE, {"a": BASE["a"] - 2, "b": BASE["b"] + 4})
        packed = mixed(BASE, [(one, 0.5), (other, 0.25)])
        np.testing.assert_array_equal(packed["a"], np.array([1.0, 2.0], np.float16))
        np.testing.assert_array_equal(packed["b"], np.array([9.0], np.float16))
        self.assertEqual(packed["a"].dtype, np.float16)

    def test_weights_of_another_model_are_refused(self):
        with self.assertRaises(SystemExit):
            changed_weights(BASE, {"c": BASE["a"]})


if __name__ == "__main__":
    unittest.main()
