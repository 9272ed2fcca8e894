"""Poses of a person as rotations of bones: standing, walking, sitting, crouching, bending, reaching, lying, low.

A pose maps a bone to ("direction", vector), ("relative", rotation) or ("absolute", rotation), in the body's frame:
x to the person's left, y up, z to the front.
"""

import numpy as np

KINDS = {
    "standing": 0.34,
    "walking": 0.30,
    "sitting": 0.24,
    "bending": 0.05,
    "crouching": 0.04,
    "reaching": 0.03,
}
LYING = {"on_back": 0.3, "on_side": 0.25, "face_down": 0.2, "curled": 0.25}
"""Kinds whose body lies: the head toward the back of the pelvis, +y in the scene."""
LOW = {"kneeling": 0.3, "crawling": 0.25, "floor_sitting": 0.25, "getting_up": 0.2}
SIDES = ((1, "L"), (-1, "R"))


def turn(axis, degrees):
    t = np.deg2rad(degrees)
    c, s = np.cos(t), np.sin(t)
    return {
        "x": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
        "y": np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
        "z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]),
    }[axis]


def _walking_legs(pose, rng):
    phase, stride = rng.uniform(0, 2 * np.pi), rng.uniform(18, 34)
    for s, side in SIDES:
        angle = phase + (0 if s > 0 else np.pi)
        swing, speed = np.sin(angle), np.cos(angle)
        thigh, knee = (
            np.deg2rad(stride * swing + 3),
            np.deg2rad(8 + 38 * max(speed, 0) + (6 if swing < 0 else 0)),
        )
        pose[f"upperleg01.{side}"] = ("direction", [0.05 * s, -np.cos(thigh), np.sin(thigh)])
        pose[f"lowerleg01.{side}"] = ("direction", [0.02 * s, -np.cos(thigh - knee), np.sin(thigh - knee)])
        pose[f"foot.{side}"] = ("absolute", turn("x", 18 * max(-swing, 0) - 6 * max(swing, 0)))
        arm = np.deg2rad(-0.9 * stride * swing)
        pose[f"upperarm01.{side}"] = ("direction", [0.22 * s, -np.cos(arm), np.sin(arm)])
        pose[f"lowerarm01.{side}"] = ("direction", [0.08 * s, -np.cos(arm + 0.45), np.sin(arm + 0.45)])


def _other_legs(pose, kind, rng):
    u = rng.uniform
    for s, side in SIDES:
        if kind == "sitting":
            pose[f"upperleg01.{side}"] = ("direction", [u(0.05, 0.3) * s, u(-0.12, 0.0), 1])
            pose[f"lowerleg01.{side}"] = ("direction", [0.03 * s, -1, u(-0.4, 0.35)])
            pose[f"foot.{side}"] = ("absolute", np.eye(3))
        elif kind == "crouching":
            pose[f"upperleg01.{side}"] = ("direction", [u(0.1, 0.3) * s, u(0.1, 0.4), 1])
            pose[f"lowerleg01.{side}"] = ("direction", [0.03 * s, -1, u(-0.9, -0.6)])
            pose[f"foot.{side}"] = ("absolute", turn("x", u(0, 25)))
        else:
            pose[f"upperleg01.{side}"] = ("direction", [u(0.02, 0.14) * s, -1, u(-0.05, 0.1)])
            pose[f"lowerleg01.{side}"] = ("direction", [u(0, 0.08) * s, -1, u(-0.09, 0)])
            pose[f"foot.{side}"] = ("absolute", turn("y", u(0, 22) * s))
        pose[f"upperarm01.{side}"] = ("direction", [u(0.15, 0.3) * s, -1, u(-0.12, 0.14)])
        pose[f"lowerarm01.{side}"] = ("direction", [u(-0.06, 0.16) * s, -1, u(0.05, 0.5)])


def _laid(pose, rotation):
    """The pose of a body as a whole turned by `rotation`."""
    turned = {
        bone: (how, value if how == "relative" else rotation @ np.asarray(value)) for bone, (how, value) in pose.items()
    }
    return {**turned, "root": ("absolute", rotation)}


def lying_pose(kind, rng):
    """A lying body. The floor is behind its back before the roll about its long axis."""
    u, pose = rng.uniform, {}
    is_on_side = kind in ("on_side", "curled")
    roll = {"on_back": u(-15, 15), "face_down": 180 + u(-15, 15)}.get(kind, rng.choice([-1, 1]) * u(70, 108))
    bent = {"on_side": (0.1, 0.9), "curled": (0.9, 1.6)}.get(kind, (0, 0))
    low = -1.0 if kind == "face_down" else 1.0
    raised = rng.integers(2) if kind == "on_back" and rng.random() < 0.4 else None
    arm_out = SIDES[rng.integers(2)][1] if not is_on_side and rng.random() < 0.5 else None
    for k, (s, side) in enumerate(SIDES):
        hip = u(*bent)
        pose[f"upperleg01.{side}"] = ("direction", [u(0, 0.22) * s, -np.cos(hip), np.sin(hip)])
        pose[f"lowerleg01.{side}"] = ("direction", [u(0, 0.1) * s, -1, -u(0.4, 1.1) * hip])
        if k == raised:
            pose[f"upperleg01.{side}"] = ("direction", [0.1 * s, -1, u(0.6, 1.1)])
            pose[f"lowerleg01.{side}"] = ("direction", [0, -1, -u(0.8, 1.2)])
        upper, lower = [u(0.15, 0.5) * s, -1, u(0, 0.06) * low], [u(-0.1, 0.3) * s, -1, u(0, 0.25) * low]
        if is_on_side:
            upper, lower = [0.1 * s, u(-0.9, 0.3), 1], [-0.1 * s, u(-0.3, 0.9), 1]
        elif side == arm_out:
            upper, lower = [s, u(-0.3, 0.6), 0.05 * low], [s, u(-0.4, 1.2), 0.1 * low]
        elif kind == "face_down" and rng.random() < 0.5:
            upper, lower = [s, u(-0.3, 0.5), -0.05], [0.1 * s, 1, -0.1]
        elif kind == "on_back" and rng.random() < 0.4:
            upper, lower = [0.35 * s, -1, 0.1], [-0.8 * s, u(-0.3, 0.3), 0.4]
        pose[f"upperarm01.{side}"], pose[f"lowerarm01.{side}"] = ("direction", upper), ("direction", lower)
    pose["spine03"] = ("relative", turn("x", u(-4, 8) + 18 * bent[1]) @ turn("z", u(-10, 10)))
    pose["neck01"] = ("relative", turn("x", u(-5, 10) + 8 * bent[1]) @ turn("y", u(-35, 35)))
    return _laid(pose, turn("x", -90) @ turn("y", roll))


def low_pose(kind, rng):
    """A body near the floor that does not lie: as before, during or after a fall, at play, in sport."""
    u, pose = rng.uniform, {}
    lean = {"crawling": u(60, 85), "getting_up": u(-50, -25), "kneeling": u(-5, 30), "floor_sitting": u(-15, 20)}[kind]
    one_knee = rng.integers(2) if kind == "kneeling" and rng.random() < 0.4 else None
    for k, (s, side) in enumerate(SIDES):
        thigh, shin = {
            "kneeling": ([0.15 * s, -1, u(0.0, 0.5)], [0.05 * s, -0.12, -1]),
            "crawling": ([0.12 * s, -1, u(-0.3, 0.4)], [0, -0.1, -1]),
        }.get(kind, ([0.25 * s, u(0.0, 0.9), 1], [0.05 * s, u(-1.0, -0.1), 1]))
        if k == one_knee:
            thigh, shin = [0.15 * s, 0.05, 1], [0, -1, 0.05]
        upper, lower = [0.2 * s, -1, u(0.1, 0.6)], [-0.1 * s, u(-0.8, 0.2), 1]
        if kind == "crawling":
            upper, lower = [0.12 * s, -1, u(-0.2, 0.4)], [0, -1, u(0, 0.2)]
        elif kind == "getting_up":
            upper, lower = [0.3 * s, -1, -u(0.3, 0.8)], [0.1 * s, -1, -0.1]
        pose[f"upperleg01.{side}"], pose[f"lowerleg01.{side}"] = ("direction", thigh), ("direction", shin)
        pose[f"upperarm01.{side}"], pose[f"lowerarm01.{side}"] = ("direction", upper), ("direction", lower)
    pose["spine03"] = ("relative", turn("x", u(-3, 15)) @ turn("y", u(-12, 12)))
    pose["neck01"] = ("relative", turn("x", u(-20, 10) - 0.4 * max(lean, 0)) @ turn("y", u(-30, 30)))
    pose["root"] = ("absolute", turn("x", lean))
    return pose


ARMS = {
    "phone": lambda s, u: ([0.2 * s, -1, 0.25], [-0.35 * s, 0.55, 0.9]),
    "call": lambda s, u: ([0.45 * s, -0.9, 0.2], [0.0 * s, 1, 0.15]),
    "point": lambda s, u: ([0.3 * s, -0.25 + u(-0.2, 0.3), 1], [0.1 * s, -0.1, 1]),
    "hips": lambda s, u: ([0.75 * s, -0.8, -0.25], [-0.8 * s, -0.55, 0.35]),
    "crossed": lambda s, u: ([0.25 * s, -0.95, 0.3], [-0.85 * s, 0.1 + 0.1 * s, 0.55]),
    "lap": lambda s, u: ([0.2 * s, -1, 0.3], [-0.25 * s, -0.25, 1]),
    "table": lambda s, u: ([0.3 * s, -0.8, 0.6], [-0.3 * s, 0.05, 1]),
    "carry": lambda s, u: ([0.2 * s, -1, 0.1], [-0.1 * s, -0.1, 1]),
    "push": lambda s, u: ([0.2 * s, -1, 0.55], [0.0, -0.35, 1]),
    "up": lambda s, u: ([0.35 * s, 1, 0.3], [0.1 * s, 1, 0.25]),
    "behind": lambda s, u: ([0.3 * s, -1, -0.35], [-0.6 * s, -0.8, -0.25]),
}
STANDING_ARMS = ("none", "none", "none", "hips", "crossed", "phone", "call", "point", "carry", "behind", "up")
SITTING_ARMS = ("lap", "table", "table", "table", "phone", "crossed", "call")
ONE_SIDED = ("call", "point", "up")


def random_pose(kind, rng, arms=None):
    """A pose of a kind, and the name of what the arms do."""
    if kind in LYING or kind in LOW:
        return (lying_pose if kind in LYING else low_pose)(kind, rng), "none"
    u, pose = rng.uniform, {}
    pose["spine03"] = ("relative", turn("x", u(-3, 8)) @ turn("y", u(-12, 12)) @ turn("z", u(-4, 4)))
    pose["neck01"] = ("relative", turn("x", u(-6, 16)) @ turn("y", u(-30, 30)))
    pose["head"] = ("relative", turn("x", u(-6, 12)) @ turn("y", u(-20, 20)))
    if kind == "walking":
        _walking_legs(pose, rng)
        arms = arms or str(rng.choice(["none", "none", "none", "phone", "carry", "call"]))
    else:
        _other_legs(pose, kind, rng)
    if kind == "sitting":
        pose["spine04"] = ("relative", turn("x", u(-12, 22)))
        arms = arms or str(rng.choice(SITTING_ARMS))
    elif kind == "bending":
        pose["spine05"] = ("relative", turn("x", u(25, 60)))
        pose["spine04"] = ("relative", turn("x", u(10, 25)))
        arms = arms or str(rng.choice(["carry", "none", "table"]))
    elif kind == "crouching":
        pose["spine05"] = ("relative", turn("x", u(10, 35)))
        arms = arms or str(rng.choice(["carry", "lap", "none"]))
    elif kind == "reaching":
        arms = arms or "up"
    arms = arms or str(rng.choice(STANDING_ARMS))
    if arms in ARMS:
        sides = (
            [SIDES[rng.integers(2)]]
            if arms in ONE_SIDED or (arms in ("phone", "hips") and rng.random() < 0.5)
            else SIDES
        )
        for s, side in sides:
            upper, lower = ARMS[arms](s, u)
            pose[f"upperarm01.{side}"], pose[f"lowerarm01.{side}"] = (
                ("direction", upper),
                ("direction", lower),
            )
    if arms == "phone":
        pose["head"] = ("relative", turn("x", u(12, 24)))
    return pose, arms
