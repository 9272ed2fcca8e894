"""Zones of a room: office desks, canteen, class, shop, lounge, waiting area, library, hall. Each fills a rectangle."""

import math

from . import furniture as f
from .scene import CHAIR_WITH_JACKET, COATS, IMAGE_OF_PERSON, PRAM


def chair(room, b, height=0.45, style=None):
    jacket = room.rng.random() < 0.18
    f.chair(b.child(0, 0, index=CHAIR_WITH_JACKET if jacket else 0), room.palette, height, style, jacket)
    room.occupy(b, 0.24, 0.26)


def table(room, b, width, depth, height=0.74, **more):
    f.table(b, room.palette, width, depth, height, **more)
    room.occupy(b, width / 2, depth / 2)


def grid(room, b, width, depth, pitch_x, pitch_y, skip=0.2):
    """Builders on a jittered grid that fills the zone."""
    columns, rows = max(1, int(width // pitch_x)), max(1, int(depth // pitch_y))
    for i in range(columns):
        for j in range(rows):
            if room.rng.random() >= skip:
                cell = b.child(
                    (i + 0.5) / columns * width - width / 2 + float(room.rng.normal() * 0.06),
                    (j + 0.5) / rows * depth - depth / 2 + float(room.rng.normal() * 0.06),
                )
                if room.is_free(cell, min(pitch_x, pitch_y) / 2):
                    yield cell


def office(room, b, width, depth):
    for cell in grid(room, b, width, depth, 2.4, 2.6):
        desk = cell.child(0, 0, float(room.rng.choice([0, 180]) + room.rng.normal() * 2))
        table(room, desk, 1.5, 0.75, things=2)
        for k in range(int(room.rng.integers(1, 3))):
            screen(room, desk.child(-0.3 + 0.6 * k, -0.2), 0.74)
        chair(
            room,
            desk.child(float(room.rng.uniform(-0.2, 0.2)), 0.62, float(room.rng.normal() * 20)),
            style="office",
        )


def screen(room, b, z, person=0.1):
    p = room.palette
    name = room.portrait() if room.rng.random() < person else f"screen{room.rng.integers(4)}"
    made = p.texture(name, uv=True, emit=0.7)
    b.box(0.55, 0.03, 0.33, 0, 0, z + 0.32, p.black, bevel=0)
    b.child(0, 0, index=IMAGE_OF_PERSON if "portrait" in name else 0).plane(
        0.52, 0.3, 0, 0.017, z + 0.32, made, rx=math.pi / 2, rz=math.pi
    )
    b.box(0.04, 0.03, 0.2, 0, -0.01, z + 0.09, p.black, bevel=0)


def canteen(room, b, width, depth):
    round_ = bool(room.rng.random() < 0.5)
    for cell in grid(room, b, width, depth, 2.3, 2.3):
        size, turned = float(room.rng.uniform(0.7, 1.1)), float(room.rng.normal() * 8)
        table(room, cell.child(0, 0, turned), size, size, round_=round_)
        for a in (0, 90, 180, 270):
            if room.rng.random() < 0.7:
                chair(
                    room,
                    cell.child(0, 0, a + turned).child(
                        0, size / 2 + float(room.rng.uniform(0.1, 0.4)), float(room.rng.normal() * 15)
                    ),
                )


def class_rows(room, b, width, depth):
    for cell in grid(room, b, width, depth, 1.7, 1.5, 0.1):
        table(room, cell, 1.2, 0.55, 0.73, things=1)
        for x in (-0.3, 0.3):
            chair(room, cell.child(x, 0.5, float(room.rng.normal() * 10)))


def meeting(room, b, width, depth):
    long = min(width - 2, float(room.rng.uniform(1.8, 4.5)))
    if not room.is_free(b, long / 2):
        return
    table(room, b, long, 1.2)
    for k in range(max(2, int(long / 0.75))):
        x = (k + 0.5) / max(2, int(long / 0.75)) * long - long / 2
        for side in (1, -1):
            chair(room, b.child(x, side * 0.9, (0 if side > 0 else 180) + float(room.rng.normal() * 12)))


def shop(room, b, width, depth):
    for cell in grid(room, b, width, depth, 2.2, 2.6, 0.12):
        kind = room.rng.integers(6)
        if kind < 3:
            w, h = float(room.rng.uniform(1.2, 2.2)), float(room.rng.choice([1.1, 1.5, 1.9]))
            for turned in (90, 270):
                f.shelf(cell.child(0, 0, turned), room.palette, w, h, 0.17)
            room.occupy(cell.child(0, 0, 90), w / 2, 0.36)
        elif kind == 3:
            f.clothes_rail(cell.child(0, 0, float(room.rng.choice([0, 90])), COATS), room.palette)
            room.occupy(cell, 0.9, 0.9)
        elif kind == 4:
            room.mannequin(cell.child(0, 0, float(room.rng.uniform(0, 360))))
        else:
            table(room, cell, 1.4, 0.8, 0.9, things=7)


def lounge(room, b, width, depth):
    for cell in grid(room, b, width, depth, 4.2, 4.2, 0.1):
        p = room.palette
        cell.box(
            2.6,
            1.8,
            0.012,
            0,
            0,
            0.006,
            p.texture(f"rug{room.rng.integers(9)}", rough=0.95, scale=2.7),
            bevel=0,
        )
        table(room, cell, 1.1, 0.6, 0.42)
        for side in (0, 180):
            if room.rng.random() < 0.8:
                place, seats = cell.child(0, 0, side).child(0, 1.1), int(room.rng.integers(1, 4))
                f.sofa(place, p, seats)
                room.occupy(place, 0.34 * seats + 0.25, 0.5)


def waiting(room, b, width, depth):
    for cell in grid(room, b, width, depth, 3.2, 1.8, 0.15):
        for k in range(5):
            chair(room, cell.child((k - 2) * 0.52, 0), style="shell")


def library(room, b, width, depth):
    for cell in grid(room, b, width, depth, 1.7, 3.0, 0.15):
        for turned in (90, 270):
            f.shelf(cell.child(0, 0, turned), room.palette, 2.3, 1.9, 0.17)
        room.occupy(cell.child(0, 0, 90), 1.2, 0.36)


def hall(room, b, width, depth):
    """A wide free floor with a few signs, plants, prams, trolleys, benches and columns."""
    for cell in grid(room, b, width, depth, 3.4, 3.4, 0.35):
        kind, turned = room.rng.integers(9), float(room.rng.uniform(0, 360))
        place = cell.child(float(room.rng.uniform(-0.6, 0.6)), float(room.rng.uniform(-0.6, 0.6)), turned)
        if kind == 0:
            f.plant(place, room.palette)
            room.occupy(place, 0.3, 0.3)
        elif kind == 1:
            room.sign(place)
        elif kind == 2:
            f.pram(place.child(0, 0, index=PRAM), room.palette)
            room.occupy(place, 0.35, 0.6)
        elif kind == 3:
            f.trolley(place, room.palette)
            room.occupy(place, 0.35, 0.6)
        elif kind == 4:
            f.coat_rack(place.child(0, 0, index=COATS), room.palette)
            room.occupy(place, 0.4, 0.4)
        elif kind == 5:
            f.boxes(place, room.palette)
            room.occupy(place, 0.3, 0.3)
        elif kind == 6:
            place.box(1.6, 0.45, 0.06, 0, 0, 0.44, room.palette.wood[0])
            place.box(1.4, 0.3, 0.41, 0, 0, 0.205, room.palette.black, bevel=0)
            room.occupy(place, 0.8, 0.25)
        elif kind == 7:
            f.suitcase(place, room.palette)
            room.occupy(place, 0.25, 0.2)
        else:
            room.mannequin(place)


ZONES = {
    "train": (office, canteen, class_rows, meeting, shop, lounge, hall, hall),
    "unseen": (waiting, library, canteen, shop, hall, hall),
}
