"""Furniture and clutter as simple solids: used in rooms and in the pieces that persons are rendered with."""

import math

import bpy
import numpy as np

from .blender import link, material


class Palette:
    """The materials of one room or piece, drawn at random."""

    def __init__(self, rng, textures, split="train"):
        r, self.rng, self.textures = rng, rng, str(textures)
        self.wood = [material(texture=f"{textures}/wood{i}.png", rough=0.45, scale=1.2) for i in r.permutation(6)[:3]]
        self.metal = material((0.55, 0.55, 0.57), 0.35, metal=0.8)
        self.black, self.white = material((0.03, 0.03, 0.035), 0.5), material((0.75, 0.75, 0.74), 0.4)
        self.cloth = material(self.colour(0.02, 0.5), 0.9)
        self.cloth2 = material(self.colour(0.02, 0.6), 0.9)
        self.seat = [self.cloth, self.black, self.wood[1], self.white, self.cloth2][r.integers(5)]
        self.chair_style = str(
            r.choice(["four", "office", "shell", "arm"] if split == "train" else ["shell", "stool", "office"])
        )

    def colour(self, low=0.03, high=0.7):
        grey, share = self.rng.uniform(low, high), self.rng.uniform(0, 0.8)
        return tuple(round(float(grey * (1 - share) + x * share), 3) for x in self.rng.uniform(low, high, 3))

    def texture(self, name, **more):
        return material(texture=f"{self.textures}/{name}.png", **more)

    def fabric(self, split="train"):
        low, high = (0, 24) if split == "train" else (24, 32)
        return self.texture(f"fabric{self.rng.integers(low, high)}", rough=0.9, scale=0.6, tint=self.colour(0.1, 1.2))


def chair(b, p, seat_height=0.45, style=None, jacket=False):
    """A chair that faces local -y, as the person on it does. `jacket` hangs a coat over the back."""
    style, m = style or p.chair_style, p.seat
    if style in ("office", "arm"):
        b.box(0.48, 0.47, 0.08, 0, 0, seat_height - 0.04, m, bevel=0.035)
        b.box(0.45, 0.07, 0.52, 0, 0.25, seat_height + 0.33, m, bevel=0.03, rx=-0.12)
        if style == "office":
            b.cylinder(0.03, seat_height - 0.1, 0, 0, seat_height / 2, p.metal)
            for k in range(5):
                a = k * 1.2566
                b.box(0.3, 0.04, 0.03, 0.15 * math.cos(a), 0.15 * math.sin(a), 0.06, p.black, bevel=0.005, rz=a)
        else:
            for x in (-0.2, 0.2):
                for y in (-0.2, 0.2):
                    b.cylinder(0.018, seat_height - 0.05, x, y, (seat_height - 0.05) / 2, p.metal, segments=8)
        for x in (-0.27, 0.27):
            b.box(0.05, 0.26, 0.03, x, 0.02, seat_height + 0.2, p.black, bevel=0.008)
            b.box(0.03, 0.04, 0.22, x, 0.1, seat_height + 0.09, p.black, bevel=0.005)
    elif style == "stool":
        b.cylinder(0.17, 0.05, 0, 0, seat_height - 0.025, m)
        for x, y in ((-0.1, -0.1), (0.1, -0.1), (-0.1, 0.1), (0.1, 0.1)):
            b.cylinder(0.015, seat_height - 0.05, x, y, (seat_height - 0.05) / 2, p.metal, segments=8)
        return
    else:
        legs = p.metal if style == "shell" else p.wood[1]
        b.box(0.43, 0.43, 0.045, 0, 0, seat_height - 0.022, m, bevel=0.018)
        b.box(
            0.42,
            0.035,
            0.36 if style == "shell" else 0.42,
            0,
            0.215,
            seat_height + 0.24,
            m,
            bevel=0.012,
            rx=-0.14,
        )
        for x in (-0.18, 0.18):
            for y in (-0.18, 0.19):
                b.cylinder(0.016, seat_height - 0.04, x, y, (seat_height - 0.04) / 2, legs, segments=8)
    if jacket:
        coat, top = p.fabric(), seat_height + 0.48
        b.box(0.48, 0.13, 0.5, 0, 0.27, top - 0.24, coat, bevel=0.055, rx=-0.1)
        b.cylinder(0.07, 0.5, 0, 0.26, top, coat, ry=math.pi / 2)
        for x in (-0.23, 0.23):
            b.cylinder(0.055, 0.48, x, 0.28, top - 0.25, coat, top=0.04, rx=float(p.rng.uniform(-0.15, 0.15)))


def table(b, p, width, depth, height=0.74, round_=False, top=None, things=None):
    top = top or p.wood[0]
    if round_:
        b.cylinder(width / 2, 0.03, 0, 0, height - 0.015, top, segments=32)
        b.cylinder(0.04, height - 0.03, 0, 0, (height - 0.03) / 2, p.metal)
        b.cylinder(0.28, 0.02, 0, 0, 0.01, p.metal)
    else:
        b.box(width, depth, 0.03, 0, 0, height - 0.015, top, bevel=0.008)
        for x in (-1, 1):
            for y in (-1, 1):
                b.box(
                    0.045,
                    0.045,
                    height - 0.03,
                    x * (width / 2 - 0.06),
                    y * (depth / 2 - 0.06),
                    (height - 0.03) / 2,
                    p.metal,
                    bevel=0,
                )
    things_on(b, p, width, depth, height, int(p.rng.integers(0, 6)) if things is None else things)


def things_on(b, p, width, depth, height, count):
    """Paper, cups, laptops, books, plates, bags and screens on a table top."""
    r = p.rng
    for _ in range(count):
        x, y, a = (
            float(r.uniform(-0.4, 0.4)) * width,
            float(r.uniform(-0.4, 0.4)) * depth * 0.8,
            float(r.uniform(0, 6.28)),
        )
        kind = r.integers(7)
        if kind == 0:
            b.plane(0.21, 0.297, x, y, height + 0.002, p.white, rz=a)
        elif kind == 1:
            b.cylinder(0.035, 0.09, x, y, height + 0.045, material(p.colour(), 0.4), top=0.04)
        elif kind == 2:
            b.box(0.33, 0.23, 0.015, x, y, height + 0.008, p.metal, bevel=0, rz=a)
            b.child(x, y, math.degrees(a)).box(0.33, 0.01, 0.22, 0, 0.12, height + 0.11, p.black, bevel=0, rx=-0.25)
        elif kind == 3:
            b.box(0.17, 0.24, 0.025, x, y, height + 0.012, material(p.colour(), 0.6), bevel=0, rz=a)
        elif kind == 4:
            b.cylinder(0.1, 0.02, x, y, height + 0.01, p.white, top=0.12)
        elif kind == 5:
            b.box(0.35, 0.16, 0.28, x, y, height + 0.14, material(p.colour(), 0.8), bevel=0.05, rz=a)
        else:
            b.box(0.5, 0.03, 0.32, x, y, height + 0.3, p.black, bevel=0.006, rz=a * 0.05)
            b.box(0.2, 0.16, 0.015, x, y, height + 0.008, p.black, bevel=0)
            b.box(0.04, 0.03, 0.2, x, y, height + 0.1, p.black, bevel=0)


def sofa(b, p, seats):
    w, m = 0.68 * seats + 0.3, p.cloth
    b.box(w, 0.85, 0.25, 0, 0.05, 0.2, m, bevel=0.04)
    b.box(w, 0.22, 0.75, 0, 0.4, 0.43, m, bevel=0.06, rx=-0.08)
    for side in (-1, 1):
        b.box(0.17, 0.85, 0.55, side * (w / 2 - 0.02), 0.05, 0.33, m, bevel=0.05)
    for k in range(seats):
        b.box(0.66, 0.68, 0.15, (k + 0.5) * 0.68 - 0.34 * seats, -0.04, 0.38, m, bevel=0.045)
    for _ in range(int(p.rng.integers(0, 3))):
        b.box(0.4, 0.14, 0.38, float(p.rng.uniform(-0.4, 0.4)) * w, 0.2, 0.62, p.cloth2, bevel=0.06, rx=-0.3)


def bed(b, p):
    """A bed along +y with its pillow there; its top is at 0.47 m."""
    b.box(0.95, 2.05, 0.3, 0, 0, 0.15, p.wood[0])
    b.box(0.9, 2.0, 0.17, 0, 0, 0.385, p.white, bevel=0.04)
    b.box(0.6, 0.35, 0.1, 0, 0.8, 0.46, p.cloth2, bevel=0.04)


def shelf(b, p, width=None, height=None, y=0.18):
    """A shelf with books, boxes and folded clothes."""
    r, w, h = p.rng, width or float(p.rng.uniform(0.8, 1.6)), height or float(p.rng.uniform(1.2, 2.2))
    for side in (-w / 2, w / 2):
        b.box(0.025, 0.32, h, side, y, h / 2, p.wood[2], bevel=0)
    levels = max(3, int(h / 0.4))
    for i in range(levels + 1):
        b.box(w, 0.32, 0.022, 0, y, max(0.02, i * h / levels - 0.011), p.wood[2], bevel=0)
    for i in range(levels):
        x = -w / 2 + 0.03
        while x < w / 2 - 0.1:
            thick = float(r.uniform(0.05, 0.25))
            tall = float(r.uniform(0.1, 0.3))
            if r.random() < 0.8 and x + thick < w / 2 - 0.02:
                v = float(r.choice([0.06, 0.15, 0.3, 0.5, 0.65]))
                tone = [(1, 1, 1), (1.25, 0.8, 0.7), (0.75, 0.9, 1.3), (0.8, 1.1, 0.8)][r.integers(4)]
                b.box(
                    thick * 0.95,
                    float(r.uniform(0.15, 0.27)),
                    tall,
                    x + thick / 2,
                    y + 0.02,
                    i * h / levels + tall / 2 + 0.01,
                    material(tuple(round(v * k, 3) for k in tone), 0.7),
                    bevel=0,
                )
            x += thick


def plant(b, p):
    r = p.rng
    b.cylinder(0.13, 0.3, 0, 0, 0.15, p.white if r.random() < 0.5 else material((0.4, 0.2, 0.12), 0.8), top=0.18)
    tall, vertices, faces = float(r.uniform(0.4, 1.3)), [], []
    for _ in range(int(r.integers(30, 70))):
        a, share, long, wide = (
            r.uniform(0, 6.28),
            r.uniform(0.2, 1),
            float(r.uniform(0.25, 0.5)),
            float(r.uniform(0.04, 0.1)),
        )
        rise, base = r.uniform(0.2, 1.2), len(vertices)
        d = np.array([math.cos(a) * math.cos(rise), math.sin(a) * math.cos(rise), math.sin(rise)])
        n = np.array([-math.sin(a), math.cos(a), 0])
        for u, w in ((0.05, 0.1), (0.35, 1), (0.7, 0.8), (1, 0.02)):
            centre = np.array([0, 0, 0.3 + tall * share * 0.6]) + d * long * u - np.array([0, 0, 0.375 * long * u * u])
            vertices += [tuple(centre + n * wide * w), tuple(centre - n * wide * w)]
        faces += [(base + 2 * k, base + 2 * k + 1, base + 2 * k + 3, base + 2 * k + 2) for k in range(3)]
    mesh = bpy.data.meshes.new("plant")
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(material((0.05, round(float(r.uniform(0.12, 0.3)), 2), 0.06), 0.5))
    item = link(bpy.data.objects.new("plant", mesh))
    item.matrix_world, item.pass_index = b.matrix, b.index


def pram(b, p):
    """A pram that is pushed toward local -y."""
    cloth = material(p.colour(0.02, 0.5), 0.9)
    for x in (-0.27, 0.27):
        for y in (-0.38, 0.35):
            b.cylinder(0.12, 0.04, x, y, 0.12, p.black, ry=math.pi / 2)
        b.box(0.025, 0.95, 0.025, x, 0.15, 0.6, p.metal, bevel=0, rx=-0.75)
    b.box(0.46, 0.85, 0.3, 0, -0.05, 0.55, cloth, bevel=0.08)
    b.cylinder(0.26, 0.45, 0, -0.25, 0.72, cloth, ry=math.pi / 2, segments=20)
    b.box(0.5, 0.035, 0.035, 0, 0.52, 0.98, p.black, bevel=0.01)


def trolley(b, p):
    """A shopping trolley, pushed toward local -y."""
    for x in (-0.25, 0.25):
        for k in range(7):
            b.box(0.012, 0.85, 0.012, x, 0, 0.5 + 0.07 * k, p.metal, bevel=0)
        for y in (-0.38, 0.38):
            b.cylinder(0.06, 0.03, x, y, 0.06, p.black, ry=math.pi / 2)
            b.box(0.03, 0.03, 0.9, x, y, 0.5, p.metal, bevel=0)
    for k in range(9):
        b.box(0.5, 0.012, 0.012, 0, -0.4 + 0.1 * k, 0.48, p.metal, bevel=0)
    b.box(0.55, 0.04, 0.04, 0, 0.48, 1.0, material(p.colour(), 0.5), bevel=0.01)
    for _ in range(int(p.rng.integers(0, 7))):
        b.box(
            0.15,
            0.2,
            0.2,
            float(p.rng.uniform(-0.15, 0.15)),
            float(p.rng.uniform(-0.3, 0.3)),
            0.6,
            material(p.colour(), 0.7),
            bevel=0.01,
        )


def coat_rack(b, p, coats=None):
    """A stand or a wall rail with coats, scarves and bags."""
    r, count = p.rng, coats or int(p.rng.integers(2, 7))
    b.cylinder(0.02, 1.75, 0, 0, 0.875, p.metal)
    b.cylinder(0.22, 0.03, 0, 0, 0.015, p.metal)
    for k in range(count):
        a, long = k * 6.283 / count + float(r.normal() * 0.2), float(r.uniform(0.6, 1.15))
        coat = p.fabric()
        x, y = 0.17 * math.cos(a), 0.17 * math.sin(a)
        b.cylinder(float(r.uniform(0.13, 0.2)), long, x, y, 1.65 - long / 2, coat, top=0.09, scale=(1, 0.7))
        b.sphere(0.1, x, y, 1.63, coat, scale=(1.2, 0.8, 0.7))
    if r.random() < 0.5:
        b.sphere(0.13, 0, 0, 1.78, material(p.colour(), 0.8), lower=-0.1)


def clothes_rail(b, p):
    """A shop's rail with garments on hangers."""
    w = float(p.rng.uniform(1.0, 1.8))
    for x in (-w / 2, w / 2):
        b.cylinder(0.015, 1.5, x, 0, 0.75, p.metal, segments=8)
    b.cylinder(0.015, w, 0, 0, 1.5, p.metal, segments=8, ry=math.pi / 2)
    for k in range(int(w / 0.09)):
        long = float(p.rng.uniform(0.55, 1.0))
        b.box(
            0.05,
            0.42,
            long,
            -w / 2 + 0.06 + 0.09 * k,
            0,
            1.42 - long / 2,
            p.fabric() if k % 3 == 0 else material(p.colour(), 0.9),
            bevel=0.02,
            rz=float(p.rng.normal() * 0.1),
        )


def boxes(b, p):
    z = 0.0
    for _ in range(int(p.rng.integers(1, 5))):
        h = float(p.rng.uniform(0.2, 0.45))
        b.box(
            0.45,
            0.38,
            h,
            float(p.rng.uniform(-0.04, 0.04)),
            0,
            z + h / 2,
            material((0.45, 0.32, 0.2), 0.9),
            bevel=0.004,
            rz=float(p.rng.uniform(-0.2, 0.2)),
        )
        z += h


def suitcase(b, p):
    b.box(0.42, 0.25, 0.62, 0, 0, 0.36, material(p.colour(), 0.4), bevel=0.04)
    b.box(0.2, 0.02, 0.35, 0, 0.1, 0.8, p.black, bevel=0)


def counter(b, p, width):
    b.box(width, 0.6, 1.0, 0, 0, 0.5, p.wood[0], bevel=0.01)
    b.box(width + 0.1, 0.7, 0.04, 0, 0, 1.02, p.white, bevel=0.01)
    things_on(b, p, width, 0.5, 1.04, int(p.rng.integers(1, 5)))


def flip_board(b, p):
    """A standing sign or roll-up with a poster: as tall as a person."""
    w, h = float(p.rng.uniform(0.6, 0.9)), float(p.rng.uniform(1.2, 2.0))
    b.box(w, 0.03, h, 0, 0, h / 2 + 0.1, p.white, bevel=0)
    b.box(w, 0.3, 0.06, 0, 0, 0.05, p.metal, bevel=0)
    return w, h
