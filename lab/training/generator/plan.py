"""Floor plans that are not rectangles: parts of the building that stand in the rectangle of a room.

A part is a solid block, `(x, y, half_width, half_depth, degrees)` in meters from the middle of the room. Its front has the
local direction +y. Standard library only.
"""

import math

LARGE = 40.0
"""Meters: width and depth of the block behind a slanted wall, beyond every room."""
CLEAR = 1.5
"""Meters between a part and the camera."""
TRIES = 40


def is_within(part, x, y, margin=0.0):
    """True where a point is in a block, or at most `margin` beside it."""
    px, py, half_width, half_depth, degrees = part
    turned = math.radians(-degrees)
    u = (x - px) * math.cos(turned) - (y - py) * math.sin(turned)
    v = (x - px) * math.sin(turned) + (y - py) * math.cos(turned)
    return abs(u) < half_width + margin and abs(v) < half_depth + margin


def corner(rng, width, depth):
    """A quarter that is left out, for the plan of an L."""
    wide, deep = (float(rng.uniform(0.2, 0.45) * side) for side in (width, depth))
    x, y = (float(rng.choice([-1, 1])) for _ in range(2))
    return (x * (width - wide) / 2, y * (depth - deep) / 2, wide / 2, deep / 2, 0.0 if y < 0 else 180.0)


def slanted_wall(rng, width, depth):
    """A wall that cuts off a corner, or stands at 8 to 30 degrees to a side."""
    off = float(rng.uniform(8, 30) if rng.random() < 0.6 else rng.uniform(30, 60))
    degrees = float(rng.choice([0, 90, 180, 270])) + off
    inward = -math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    # The distance of the outermost corner of the room, less what the wall cuts off.
    reach = (abs(inward[0]) * width + abs(inward[1]) * depth) / 2
    away = reach * float(rng.uniform(0.5, 0.85)) + LARGE / 2
    return (-inward[0] * away, -inward[1] * away, LARGE / 2, LARGE / 2, degrees)


def parts(rng, width, depth, camera):
    """One to three parts that leave the place of the camera free."""
    wanted, found = int(rng.integers(1, 4)), []
    for _ in range(TRIES):
        made = (corner if rng.random() < 0.45 else slanted_wall)(rng, width, depth)
        if not is_within(made, *camera, CLEAR):
            found.append(made)
        if len(found) == wanted:
            break
    return found


def front(part, width, depth):
    """Middle and length of the part of the front of a block that is in the room."""
    x, y, half_width, half_depth, degrees = part
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    x, y = x - sin * half_depth, y + cos * half_depth
    ends = [-half_width, half_width]
    for at, step, half in ((x, cos, width / 2), (y, sin, depth / 2)):
        if abs(step) > 1e-9:
            low, high = sorted(((-half - at) / step, (half - at) / step))
            ends = [max(ends[0], low), min(ends[1], high)]
    middle = (ends[0] + ends[1]) / 2
    return x + cos * middle, y + sin * middle, max(0.0, ends[1] - ends[0])
