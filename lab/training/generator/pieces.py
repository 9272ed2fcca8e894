"""Pieces: one or a few persons with the furniture that belongs to them, centered on the origin, rendered as one crop.

Each maker returns the figures. Figures have object index 1, 2, …; furniture has index 0.
"""

import math

from . import furniture as f
from .blender import Builder
from .figures import add_figure, natural_seat
from .pose import KINDS, LOW, LYING
from .wardrobe import random_person


class Maker:
    """What the pieces are made of: the body, the generator of random numbers, the split, and the palette."""

    def __init__(self, body, rng, assets, textures, split):
        self.body, self.rng, self.assets, self.split = body, rng, assets, split
        self.palette = f.Palette(rng, textures, split)
        self.figures = []

    def person(self, kind, x=0.0, y=0.0, degrees=0.0, arms=None, seat_height=None, child=None):
        child = self.rng.random() < 0.14 if child is None else child
        who = random_person(self.rng, self.assets, self.split, child)
        if kind in LYING or kind in LOW:
            who["extras"] = []  # Bags, coats and skirts are made for upright persons.
        figure = add_figure(self.body, self.rng, who, kind, len(self.figures) + 1, x, y, degrees, arms, seat_height)
        self.figures.append(figure)
        return figure

    def seated(self, x, y, degrees, arms=None, with_chair=True):
        figure = self.person("sitting", *Builder(x, y, degrees).xy(0, 0.07), degrees, arms)
        if with_chair:
            seat = max(0.3, natural_seat(figure))
            if self.rng.random() < 0.5 and seat < 0.44:
                figure.lift(0.44 - seat)
                seat = 0.44
            f.chair(
                Builder(x, y, degrees + float(self.rng.normal() * 5)),
                self.palette,
                seat,
                jacket=self.rng.random() < 0.2,
            )
        return figure


def single(m):
    kinds = {k: w for k, w in KINDS.items() if k != "sitting"}
    total = sum(kinds.values())
    m.person(str(m.rng.choice(list(kinds), p=[w / total for w in kinds.values()])))


def seated(m):
    m.seated(0, 0, 0)


def at_desk(m):
    """A person who sits at a table with things on it; sometimes a second one opposite."""
    width, depth = float(m.rng.uniform(0.8, 1.7)), float(m.rng.uniform(0.6, 0.9))
    m.seated(0, 0, 0, "table")
    f.table(
        Builder(float(m.rng.normal() * 0.1), -0.3 - depth / 2, 0),
        m.palette,
        width,
        depth,
        things=int(m.rng.integers(1, 6)),
    )
    if m.rng.random() < 0.35:
        m.seated(0.0, -0.6 - depth, 180)


def table_group(m):
    """A table with two to four persons and perhaps an empty chair."""
    size, seats = float(m.rng.uniform(0.8, 1.3)), int(m.rng.integers(2, 5))
    f.table(Builder(), m.palette, size, size, round_=m.rng.random() < 0.5, things=int(m.rng.integers(2, 7)))
    order = m.rng.permutation(4)
    for k in range(4):
        angle = 90.0 * order[k] + float(m.rng.normal() * 6)
        x, y = Builder(degrees=angle).xy(0, size / 2 + 0.27)
        if k < seats:
            m.seated(x, y, angle)
        elif m.rng.random() < 0.6:
            f.chair(Builder(x, y, angle), m.palette, 0.45, jacket=m.rng.random() < 0.4)


def sofa_group(m):
    seats = int(m.rng.integers(1, 4))
    f.sofa(Builder(), m.palette, seats)
    for k in range(seats):
        if k == 0 or m.rng.random() < 0.6:
            m.person(
                "sitting",
                (k + 0.5) * 0.68 - 0.34 * seats,
                -0.08,
                float(m.rng.normal() * 10),
                seat_height=0.455,
            )


def pair(m):
    """Two or three persons who talk, or walk side by side; often an adult with a child."""
    gap, child = float(m.rng.uniform(0.5, 1.0)), m.rng.random() < 0.35
    if m.rng.random() < 0.5:
        m.person("standing", 0, gap / 2, 0 + float(m.rng.normal() * 20), child=False)
        m.person("standing", 0, -gap / 2, 180 + float(m.rng.normal() * 20), child=child)
        if m.rng.random() < 0.3:
            m.person("standing", gap * 0.7, 0, -90 + float(m.rng.normal() * 20))
    else:
        m.person("walking", -gap / 2, 0, 0, child=False)
        m.person("walking", gap / 2, float(m.rng.normal() * 0.15), float(m.rng.normal() * 8), child=child)


def with_pram(m):
    f.pram(Builder(0, -0.75, 0), m.palette)
    m.person("walking", 0, 0, 0, "push", child=False)


def with_trolley(m):
    f.trolley(Builder(0, -0.75, 0), m.palette)
    m.person("walking" if m.rng.random() < 0.6 else "standing", 0, 0, 0, "push")


def behind_counter(m):
    f.counter(Builder(0, -0.62, 0), m.palette, float(m.rng.uniform(1.0, 2.0)))
    m.person("standing", 0, 0, float(m.rng.normal() * 20), str(m.rng.choice(["carry", "none", "table", "point"])))


def _one_of(m, kinds):
    return str(m.rng.choice(list(kinds), p=list(kinds.values())))


def low(m):
    m.person(_one_of(m, LOW))


def lying(m):
    """A person who lies on the floor, a mat, a bed or a sofa, sometimes under a blanket or a table, or with a helper."""
    figure = m.person(_one_of(m, LYING))
    low_end, high_end = (float(v) for v in (figure.vertices[:, 1].min(), figure.vertices[:, 1].max()))
    middle, long = (low_end + high_end) / 2, high_end - low_end
    place = str(m.rng.choice(["floor", "mat", "bed", "sofa", "table", "helper"], p=[0.45, 0.1, 0.12, 0.08, 0.1, 0.15]))
    if place == "mat":
        Builder(0, middle, 0).box(0.75, 1.95, 0.02, 0, 0, 0.01, m.palette.cloth2, bevel=0.008)
        figure.lift(0.02)
    elif place == "bed":
        f.bed(Builder(0, middle, 0), m.palette)
        figure.lift(0.47)
    elif place == "sofa":
        f.sofa(Builder(0.1, middle, 90), m.palette, 3)
        figure.lift(0.455)
    elif place == "table":
        across = float(m.rng.uniform(0.6, 0.9))
        f.table(Builder(0, low_end + 0.15 * long, 90), m.palette, across, 1.4, 0.74, things=2)
    elif place == "helper":
        side = float(m.rng.choice([-1, 1]))
        kind = str(m.rng.choice(["kneeling", "crouching", "bending", "standing"]))
        m.person(kind, 0.75 * side, high_end - 0.6, -90.0 * side, child=False)
    if m.rng.random() < 0.25:
        b = Builder(0, 0, 0)
        top = float(figure.world_vertices()[:, 2].max())
        cover = float(m.rng.uniform(0.35, 0.7)) * long
        b.sphere(1.0, 0, low_end + cover / 2, top - 0.2, m.palette.cloth, scale=(0.42, cover / 2, 0.23), lower=0.0)


MAKERS = {
    single: 0.30,
    lying: 0.09,
    low: 0.05,
    seated: 0.10,
    at_desk: 0.10,
    table_group: 0.09,
    sofa_group: 0.05,
    pair: 0.12,
    with_pram: 0.03,
    with_trolley: 0.04,
    behind_counter: 0.03,
}


def make_piece(m):
    """Makes a random piece; returns its name."""
    total = sum(MAKERS.values())
    maker = list(MAKERS)[m.rng.choice(len(MAKERS), p=[w / total for w in MAKERS.values()])]
    maker(m)
    return maker.__name__


def reach(figures):
    """How far the piece reaches from its center on the floor, in meters."""
    return max(float(abs(figure.world_vertices()[:, :2]).max()) for figure in figures) + 0.1 if figures else math.nan
