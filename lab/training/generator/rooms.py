"""Renders empty rooms as panoramas about the vertical with distances: `WORK/rooms/SPLIT/SEED.npz`. Finished files are skipped."""

import json
import math
import os
import tempfile

import numpy as np

from . import blender as bl
from . import furniture as f
from .body import Body
from .crops import encode_radiance
from .figures import add_figure
from .plan import front, is_within, parts
from .portraits import portrait_name
from .progress import Progress
from .scene import COATS, HEIGHT_SHARES, HEIGHTS, IMAGE_OF_PERSON, MANNEQUIN, floor_irradiance
from .wardrobe import random_colours, random_person
from .zones import ZONES

RESOLUTION = 1040
"""Default diameter in pixels of a panorama to 90° from the nadir."""
MOST_MANNEQUINS = 4
FLOORS = ("wood", "tile", "carpet", "terrazzo", "concrete", "checker")
WALL_PIECES = ["window", "window", "poster", "person", "door", "shelf", "coats", "board", "plant", "none", "none"]


class Room:
    """One empty room, with the camera at (0, 0, height)."""

    def __init__(self, seed, split, body, work, angled=False):
        self.rng, self.split, self.body, self.work = np.random.default_rng(seed), split, body, work
        r = self.rng
        self.palette = f.Palette(r, work / "textures", split)
        self.height = float(HEIGHTS[r.choice(len(HEIGHTS), p=HEIGHT_SHARES)] * r.uniform(0.92, 1.08))
        largest, least = float(np.clip(self.height * 7, 16, 30)), max(10.0, 3.2 * self.height)
        self.width, self.depth = (float(r.uniform(least, largest)) for _ in range(2))
        if r.random() < 0.15:
            self.depth = float(r.uniform(2.5, 4.5))  # A corridor.
        self.cx, self.cy = (float(r.uniform(-0.3, 0.3) * s) for s in (self.width, self.depth))
        self.ceiling = self.height + float(r.choice([0.05, 0.05, 0.1, 0.4, 1.0]))
        self.occupied, self.lights, self.mannequins = [], [], 0
        self.grid = bl.Builder(self.cx, self.cy)
        # Numbers of their own, so that rectangular rooms stay as they are.
        other = np.random.default_rng([seed, 1])
        self.parts = parts(other, self.width, self.depth, (-self.cx, -self.cy)) if angled else []
        self._shell()
        self._lights()
        self._zones()
        self._walls()

    def occupy(self, b, half_width, half_depth):
        self.occupied.append((*b.xy(0, 0), half_width, half_depth, b.degrees()))

    def is_free(self, b, margin=0.5):
        """True where a builder's place is in none of the parts of the building."""
        x, y = b.xy(0, 0)
        return not any(is_within(part, x - self.cx, y - self.cy, margin) for part in self.parts)

    def portrait(self):
        names = [
            n for k in range(200) if (self.work / "textures" / f"{(n := portrait_name(self.split, k))}.png").exists()
        ]
        return str(self.rng.choice(names)) if names else "poster0"

    def _numbered(self, kind, count):
        """A texture whose number belongs to the split: every fourth is unseen in training."""
        numbers = [k for k in range(count) if (k % 4 == 3) == (self.split == "unseen")]
        return f"{kind}{self.rng.choice(numbers)}"

    def _shell(self):
        r, p = self.rng, self.palette
        kind = str(r.choice(FLOORS))
        floor = self._numbered(
            f"floor_{kind}",
            {"wood": 6, "tile": 10, "carpet": 8, "terrazzo": 5, "concrete": 4, "checker": 4}[kind],
        )
        rough = 0.95 if kind == "carpet" else float(r.uniform(0.12, 0.6))
        self.grid.plane(
            self.width, self.depth, 0, 0, 0, p.texture(floor, rough=rough, scale=float(r.uniform(1.2, 3.0)))
        )
        self.sides = [
            (self.width, 0, self.depth / 2, 180),
            (self.width, 0, -self.depth / 2, 0),
            (self.depth, self.width / 2, 0, 90),
            (self.depth, -self.width / 2, 0, -90),
        ]
        for long, x, y, turned in self.sides:
            wall = self.grid.child(x, y, turned)
            wall.plane(
                long,
                self.ceiling,
                0,
                0,
                self.ceiling / 2,
                p.texture(self._numbered("wall", 12), rough=0.9, scale=3.0),
                rx=math.pi / 2,
            )
            wall.box(long, 0.015, 0.09, 0, 0.008, 0.045, p.white, bevel=0)
        for part in self.parts:
            x, y, half_width, half_depth, turned = part
            block = self.grid.child(x, y, turned)
            made = p.texture(self._numbered("wall", 12), rough=0.9, scale=3.0)
            block.box(2 * half_width, 2 * half_depth, self.ceiling, 0, 0, self.ceiling / 2, made, bevel=0)
            block.box(2 * half_width + 0.03, 2 * half_depth + 0.03, 0.09, 0, 0, 0.045, p.white, bevel=0)
            self.occupy(block, half_width, half_depth)
            x, y, long = front(part, self.width, self.depth)
            self.sides.append((long, x, y, turned))
        top = self.grid.plane(self.width, self.depth, 0, 0, self.ceiling, bl.material(p.colour(0.3, 0.8), 0.95))
        top.visible_diffuse = top.visible_glossy = top.visible_shadow = False
        for _ in range(int(r.integers(0, 5)) if self.width > 12 else 0):
            x, y = float(r.uniform(-0.45, 0.45) * self.width), float(r.uniform(-0.45, 0.45) * self.depth)
            column = self.grid.child(x, y)
            if math.hypot(x + self.cx, y + self.cy) > 1.5 and self.is_free(column):
                column.box(0.45, 0.45, self.ceiling, 0, 0, self.ceiling / 2, p.white, bevel=0.01)
                self.occupy(column, 0.25, 0.25)

    def _lights(self):
        r = self.rng
        pitch = max(3.0, self.ceiling * 0.9)
        columns, rows = max(1, round(self.width / pitch)), max(1, round(self.depth / pitch))
        power, warm = (
            float(r.uniform(10, 40)) * (pitch / 3) ** 2 * (self.ceiling / 2.6),
            float(r.uniform(0, 1)),
        )
        colour, off = (1, 0.97 - 0.12 * warm, 0.93 - 0.3 * warm), float(r.choice([0.1, 0.1, 0.5, 0.8]))
        lamp = bl.material(colour, 0.5, emit=float(r.uniform(3, 10)))
        for i in range(columns):
            for j in range(rows):
                x, y = self.grid.xy(
                    (i + 0.5) / columns * self.width - self.width / 2,
                    (j + 0.5) / rows * self.depth - self.depth / 2,
                )
                if r.random() < off or math.hypot(x, y) < 0.4:
                    continue
                long = float(r.choice([0.6, 1.2]))
                bl.area_light(x, y, self.ceiling - 0.02, 0.6, long, power, colour)
                panel = bl.Builder(x, y).plane(0.6, long, 0, 0, self.ceiling - 0.01, lamp)
                panel.visible_diffuse = panel.visible_shadow = False
                self.lights.append((x, y, self.ceiling, power))
        self.ambient = float(np.exp(r.uniform(math.log(0.08), math.log(0.7))))
        bl.ambient(self.ambient, colour)

    def _zones(self):
        r = self.rng
        across, down = max(1, round(self.width / 9)), max(1, round(self.depth / 9))
        zones = ZONES[self.split]
        main = zones[r.integers(len(zones))]
        for i in range(across):
            for j in range(down):
                zone = main if r.random() < 0.55 else zones[r.integers(len(zones))]
                wide, deep = self.width / across, self.depth / down
                b = self.grid.child((i + 0.5) * wide - self.width / 2, (j + 0.5) * deep - self.depth / 2)
                zone(self, b, max(1.5, wide - 1.8), max(1.5, deep - 1.8))

    def _walls(self):
        r = self.rng
        for long, x, y, turned in self.sides:
            wall, at = self.grid.child(x, y, turned), -long / 2 + 0.8
            while at < long / 2 - 0.8:
                kind = str(r.choice(WALL_PIECES))
                if self.is_free(wall.child(at, 0.5), 0.0):
                    self._wall_piece(wall.child(at, 0), kind)
                at += float(r.uniform(1.8, 3.5))

    def _wall_piece(self, b, kind):
        r, p = self.rng, self.palette
        if kind == "window":
            w, h = float(r.uniform(0.9, 1.7)), float(r.uniform(1.1, min(2.2, self.ceiling - 1.0)))
            b.box(
                w,
                0.02,
                h,
                0,
                0,
                0.9 + h / 2,
                bl.material((0.72, 0.84, 1.0), 0.5, emit=float(r.uniform(0.02, 5))),
                bevel=0,
            )
            for dx, dz, sx, sz in (
                (0, h / 2, w + 0.1, 0.06),
                (0, -h / 2, w + 0.1, 0.06),
                (-w / 2, 0, 0.06, h),
                (w / 2, 0, 0.06, h),
                (0, 0, 0.04, h),
            ):
                b.box(sx, 0.06, sz, dx, 0.02, 0.9 + h / 2 + dz, p.white, bevel=0)
        elif kind in ("poster", "person", "board"):
            person = kind == "person"
            w, h = (
                (float(r.uniform(0.5, 1.3)), float(r.uniform(0.8, 1.8)))
                if person
                else (float(r.uniform(0.4, 2.2)), float(r.uniform(0.5, 1.2)))
            )
            name = self.portrait() if person else self._numbered("poster", 16)
            made = (
                p.white if kind == "board" else p.texture(name, uv=True, rough=0.5, emit=float(r.choice([0, 0, 0.6])))
            )
            z = float(r.uniform(h / 2 + 0.3, max(h / 2 + 0.4, 1.7)))
            b.box(w + 0.06, 0.025, h + 0.06, 0, 0.012, z, p.black, bevel=0)
            b.child(0, 0, index=IMAGE_OF_PERSON if person else 0).plane(
                w, h, 0, 0.03, z, made, rx=math.pi / 2, rz=math.pi
            )
        elif kind == "door":
            b.box(0.95, 0.05, 2.05, 0, 0.01, 1.02, p.wood[0] if r.random() < 0.6 else p.cloth2, bevel=0.005)
        elif kind == "shelf":
            f.shelf(b, p)
            self.occupy(b, 0.8, 0.35)
        elif kind == "coats":
            for k in range(int(r.integers(1, 6))):
                tall = float(r.uniform(0.6, 1.1))
                b.child(0, 0, index=COATS).cylinder(
                    float(r.uniform(0.12, 0.2)),
                    tall,
                    k * 0.28 - 0.5,
                    0.14,
                    1.65 - tall / 2,
                    p.fabric(self.split),
                    top=0.08,
                    scale=(1, 0.6),
                )
        elif kind == "plant":
            place = b.child(0, 0.4)
            f.plant(place, p)
            self.occupy(place, 0.3, 0.3)

    def sign(self, b):
        """A roll-up with an image of a person."""
        w, h = f.flip_board(b, self.palette)
        made = self.palette.texture(self.portrait(), uv=True, rough=0.5)
        b.child(0, 0, index=IMAGE_OF_PERSON).plane(w - 0.04, h - 0.1, 0, -0.02, h / 2 + 0.1, made, rx=math.pi / 2)
        self.occupy(b, 0.5, 0.3)

    def mannequin(self, b):
        """A shop-window figure: one plain color for skin and head, dressed or not, on a base plate."""
        r = self.rng
        self.mannequins += 1
        if self.mannequins > MOST_MANNEQUINS:
            return
        who = random_person(r, self.work / "assets", self.split, False)
        who["extras"], who["wear"] = [], [w for w in who["wear"] if w[1] not in ("hair", "shoe")]
        x, y = b.xy(0, 0)
        figure = add_figure(
            self.body,
            r,
            who,
            "standing",
            MANNEQUIN,
            x,
            y,
            b.degrees(),
            str(r.choice(["none", "hips", "point"])),
        )
        colours = random_colours(r, who, self.split)
        shell = float(r.choice([0.02, 0.7, 0.8]))
        colours["skin"] = [shell, shell, shell]
        figure.colour(colours, self.work / "textures")
        if r.random() < 0.3:
            for slot in figure.object.material_slots:
                slot.material = bl.material((shell, shell, shell), 0.3)
        b.cylinder(0.22, 0.02, 0, 0, 0.01, self.palette.metal)
        self.occupy(b, 0.35, 0.35)


def render_room(scene, body, seed, work, split, scratch, samples, resolution, angled):
    bl.clear()
    room = Room(seed, split, body, work, angled)
    all_round = seed % 4 == 1
    focal = resolution / math.pi * (0.8 if all_round else 1.0)
    max_theta = math.radians(150 if all_round else 100)
    side = bl.straight_down_camera(scene, 0, 0, room.height, 0, focal, max_theta)
    scene.cycles.seed = seed % 100000
    rgba, depth, index = bl.render(scene, samples, scratch, threshold=0.1)
    white = floor_irradiance(room.lights, room.ambient, 0, 0) / math.pi
    colour = rgba[..., :3] / white
    bright = float(np.median(colour[colour.sum(2) > 0].mean(-1)))
    about = dict(
        seed=seed,
        split=split,
        camera_height=room.height,
        focal=focal,
        max_theta=max_theta,
        nadir=(side - 1) / 2,
        exposure=0.16 / max(bright, 1e-3),
        centre=(room.cx, room.cy),
        size=(room.width, room.depth),
        ceiling=room.ceiling,
        occupied=room.occupied,
        lights=[(*light[:3], light[3] / white) for light in room.lights],
        ambient=room.ambient / white,
    )
    return dict(
        colour=encode_radiance(colour),
        depth=np.clip(np.rint(depth * 1000), 0, 65535).astype(np.uint16),
        index=index,
        about=np.frombuffer(json.dumps(about).encode(), np.uint8),
    )


def render_rooms(work, first_seed, count, split="train", threads=1, samples=6, resolution=RESOLUTION, angled=False):
    folder = work / "rooms" / split
    folder.mkdir(parents=True, exist_ok=True)
    todo = [s for s in range(first_seed, first_seed + count) if not (folder / f"{s}.npz").exists()]
    progress = Progress(f"rooms {split}", len(todo), work / "log" / f"rooms-{split}.log")
    body, scene = Body(work / "assets" / "body"), bl.setup(threads)
    scene.render.use_persistent_data = False
    with tempfile.TemporaryDirectory(dir="/dev/shm" if os.path.isdir("/dev/shm") else None) as scratch:
        for seed in todo:
            arrays = render_room(scene, body, seed, work, split, scratch, samples, resolution, angled)
            partial = folder / f"{seed}.partial.npz"
            np.savez_compressed(partial, **arrays)
            partial.rename(folder / f"{seed}.npz")
            progress.step()
