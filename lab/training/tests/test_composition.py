"""Tests of the composition's mathematics: need numpy and OpenCV, not Blender.

cd training && python -m unittest discover -s tests -t .
"""

import math
import unittest
from types import SimpleNamespace

import cv2
import numpy as np
from generator.boxes import axis_box, box_along, oriented_box
from generator.compose import compose
from generator.geometry import (
    Calibration,
    camera_rotation,
    circle_radius,
    make_lens,
    nadir_angles,
    panorama_of,
    radius_of,
    theta_of,
)
from generator.placement import Placement
from generator.pose import LOW, LYING, random_pose

FOCAL, HEIGHT, SIDE = 100.0, 3.0, 401


def calibration(yaw=0.0, tilt=0.0):
    lens = dict(model="equidistant", focal=FOCAL, max_theta=math.radians(90))
    return Calibration(321, 321, lens, 160.0, 160.0, camera_rotation(yaw, tilt), HEIGHT)


def empty_room(distance=50.0):
    """A gray room whose every ray ends at one distance."""
    about = dict(
        focal=FOCAL,
        nadir=(SIDE - 1) / 2,
        max_theta=math.radians(110),
        camera_height=HEIGHT,
        centre=(0, 0),
        size=(40, 40),
        lights=[],
        ambient=1.0,
        occupied=[],
        ceiling=3.1,
    )
    return SimpleNamespace(
        about=about,
        colour=np.full((SIDE, SIDE, 3), 0.2, np.float32),
        depth=np.full((SIDE, SIDE), distance, np.float32),
        index=np.zeros((SIDE, SIDE), np.uint8),
    )


def block(distance=4.0, depth=3.0, width=21, height=41):
    """A piece: an opaque rectangle about azimuth 0, standing at a floor distance, everywhere at one depth."""
    middle = FOCAL * math.atan2(distance, HEIGHT)
    view = dict(
        camera_height=HEIGHT,
        distance=distance,
        bearing=0.0,
        focal=FOCAL,
        left=-(width // 2),
        top=round(-middle) - height // 2,
        whole={"1": width * height},
        light="soft",
    )
    crop = SimpleNamespace(
        colour=np.ones((height, width, 3), np.float32),
        alpha=np.ones((height, width), np.float32),
        depth=np.full((height, width), depth, np.float32),
        index=np.ones((height, width), np.uint8),
        view=view,
    )
    about = dict(persons=[dict(index=1, kind="standing", x=0.0, y=0.0, child=False)], reach=0.5, seed=1, piece="block")
    return SimpleNamespace(views=[view], about=about, crop=lambda k: crop, cloud=lambda: np.zeros((4, 3), np.float32))


class PoseTest(unittest.TestCase):
    def test_lying_bodies_are_level_and_low_ones_are_not(self):
        for kinds, is_level in ((LYING, True), (LOW, False)):
            for kind in kinds:
                pose, _ = random_pose(kind, np.random.default_rng(3))
                rise = abs((pose["root"][1] @ (0, 1, 0))[1])
                self.assertEqual(rise < 0.01, is_level, kind)


class Lenses(unittest.TestCase):
    def test_theta_inverts_radius_for_every_model(self):
        for seed in range(12):
            lens = make_lens(np.random.default_rng(seed), 400)
            theta = np.linspace(0.01, lens["max_theta"] - 0.01, 50)
            np.testing.assert_allclose(theta_of(lens, radius_of(lens, theta)), theta, atol=1e-4)

    def test_rays_and_projection_are_inverse(self):
        camera = calibration(0.7, 0.4)
        x, y = np.array([200.0, 90.0, 160.0]), np.array([100.0, 250.0, 161.0])
        points = camera.rays(x, y) * 5 + (0, 0, HEIGHT)
        pixels, _ = camera.project(points)
        np.testing.assert_allclose(pixels, np.stack([x, y], 1), atol=0.02)

    def test_panorama_equals_a_straight_down_equidistant_camera(self):
        points = np.array([[1.0, 2.0, 0.5], [-3.0, 0.2, 1.7]])
        pixels, _ = calibration().project(points)
        np.testing.assert_allclose(pixels - 160, panorama_of(points, HEIGHT, FOCAL), atol=1e-9)

    def test_native_calibration_has_up_against_the_axis(self):
        native = calibration().native("a")
        np.testing.assert_allclose(native["mount"]["world_up"], [0, 0, -1], atol=1e-9)

    def test_native_calibration_keeps_the_circle_of_every_model(self):
        for seed in range(12):
            lens = make_lens(np.random.default_rng(seed), 400)
            native = Calibration(900, 900, lens, 449.5, 449.5).native("a")
            self.assertAlmostEqual(circle_radius(native["lens"]), 400, places=6)


class Turning(unittest.TestCase):
    def test_turned_piece_is_the_turned_frame(self):
        camera, file = calibration(), block()
        ahead = compose(camera, empty_room(), [Placement(file, 0, 0.0, 1.0)]).ids
        right = compose(camera, empty_room(), [Placement(file, 0, math.pi / 2, 1.0)]).ids
        self.assertGreater(np.count_nonzero(ahead), 700)
        self.assertLess(np.count_nonzero(np.rot90(ahead, -1) != right), 0.05 * np.count_nonzero(ahead))

    def test_turning_camera_and_piece_together_changes_nothing(self):
        file = block()
        one = compose(calibration(), empty_room(), [Placement(file, 0, 0.3, 1.0)]).ids
        other = compose(calibration(yaw=-0.5), empty_room(), [Placement(file, 0, 0.8, 1.0)]).ids
        self.assertLess(np.count_nonzero(one != other), 0.05 * np.count_nonzero(one))

    def test_world_position_matches_the_azimuth(self):
        placement = Placement(block(), 0, 0.6, 1.1)
        x, y, _ = placement.to_world(np.zeros((1, 3)))[0]
        np.testing.assert_allclose((x, y), placement.position)
        _, phi = nadir_angles(np.array([x, y, -HEIGHT]))
        self.assertAlmostEqual(float(phi), 0.6)

    def test_tilted_camera_sees_the_piece_where_it_projects(self):
        camera, file = calibration(0.2, 0.5), block()
        ids = compose(camera, empty_room(), [Placement(file, 0, 0.0, 1.0)]).ids
        ys, xs = np.nonzero(ids)
        theta = math.atan2(4.0, HEIGHT)
        (where,), _ = camera.project(np.array([[0, math.sin(theta), HEIGHT - math.cos(theta)]]))
        np.testing.assert_allclose((xs.mean(), ys.mean()), where, atol=2.5)


class Occlusion(unittest.TestCase):
    def test_nearer_piece_hides_the_farther_one(self):
        near, far = block(distance=3.8, depth=3.0), block(distance=4.2, depth=5.0)
        both = compose(calibration(), empty_room(), [Placement(near, 0, 0, 1.0), Placement(far, 0, 0, 1.0)])
        self.assertEqual(both.ids[160 - round(FOCAL * math.atan2(3.8, HEIGHT)), 160], 2)  # Numbered from far to near.
        far_visible = np.count_nonzero(both.ids == 1)
        self.assertLess(far_visible, 0.3 * both.persons[0]["in_crop"])

    def test_room_in_front_hides_the_piece(self):
        result = compose(calibration(), empty_room(distance=2.0), [Placement(block(depth=3.0), 0, 0, 1.0)])
        self.assertEqual(np.count_nonzero(result.ids), 0)

    def test_scale_moves_the_depth(self):
        file = block(depth=3.0)
        seen = compose(calibration(), empty_room(3.1), [Placement(file, 0, 0, 1.0)]).ids
        hidden = compose(calibration(), empty_room(3.1), [Placement(file, 0, 0, 1.09)]).ids
        self.assertGreater(np.count_nonzero(seen), 0)
        self.assertEqual(np.count_nonzero(hidden), 0)


class Boxes(unittest.TestCase):
    def test_axis_box_covers_whole_pixels(self):
        mask = np.zeros((9, 9), bool)
        mask[5, 3] = True
        self.assertEqual(axis_box(mask), [3, 5, 1, 1])
        self.assertIsNone(axis_box(np.zeros((4, 4), bool)))

    def test_oriented_box_finds_a_turned_rectangle(self):
        mask = np.zeros((200, 200), np.uint8)
        corners = cv2.boxPoints(((100.0, 90.0), (30.0, 90.0), 25.0))
        cv2.fillPoly(mask, [np.rint(corners).astype(np.int32)], 1)
        cx, cy, w, h, angle = oriented_box(mask, 20.0)
        np.testing.assert_allclose((cx, cy, w, h, angle), (100.5, 90.5, 31, 91, 25), atol=2)

    def test_box_along_zero_is_the_axis_box(self):
        mask = np.zeros((50, 50), np.uint8)
        mask[10:31, 5:18] = 1
        x, y, w, h = axis_box(mask)
        np.testing.assert_allclose(box_along(mask, 0.0), [x + w / 2, y + h / 2, w, h, 0], atol=1e-6)


if __name__ == "__main__":
    unittest.main()
