"""Images of persons for posters and screens: our own persons before a plain ground. Detectors take such images for people."""

import math
import os
import tempfile

import bpy
import cv2
import numpy as np

from . import blender as bl
from .body import Body
from .pieces import Maker
from .progress import Progress
from .scene import display
from .wardrobe import random_colours


def portrait_name(split, number):
    return f"portrait_{split}_{number}"


def _camera(scene, rng, close):
    data = bpy.data.cameras.new("camera")
    item = bl.link(bpy.data.objects.new("camera", data))
    item.location = (float(rng.uniform(-0.6, 0.6)), -2.6 if close else -3.6, 1.5 if close else 1.1)
    item.rotation_euler = (
        math.pi / 2 - float(rng.uniform(-0.02, 0.08)),
        0,
        math.atan2(item.location.x, -item.location.y),
    )
    data.angle = math.radians(38)
    scene.camera = item
    scene.render.resolution_x, scene.render.resolution_y = 288, 384


def render_portraits(work, first_seed, count, threads=1):
    """Writes `count` portraits for training and half as many unseen ones to WORK/textures."""
    body, scene = Body(work / "assets" / "body"), bl.setup(threads)
    jobs = [("train", k) for k in range(count)] + [("unseen", k) for k in range(count // 2)]
    jobs = [j for j in jobs if not (work / "textures" / f"{portrait_name(*j)}.png").exists()]
    progress = Progress("portraits", len(jobs), work / "log" / "portraits.log")
    with tempfile.TemporaryDirectory(dir="/dev/shm" if os.path.isdir("/dev/shm") else None) as scratch:
        for split, k in jobs:
            rng = np.random.default_rng([first_seed, k, split == "unseen"])
            bl.clear()
            maker = Maker(body, rng, work / "assets", work / "textures", split)
            for i in range(int(rng.choice([1, 1, 2, 3]))):
                figure = maker.person(
                    str(rng.choice(["standing", "walking", "standing"])),
                    (i - 0.5) * 0.55 if i else 0.0,
                    0.0,
                    float(rng.normal() * 25),
                )
                colours = random_colours(rng, figure.who, split)
                figure.wear_extras(colours, maker.palette)
                figure.colour(colours, work / "textures")
            bl.area_light(1.5, -3, 4, 1, 1, 250, (1, 1, 1), rotation=(0.6, 0, 0.4))
            bl.ambient(0.6, (1, 1, 1))
            _camera(scene, rng, rng.random() < 0.5)
            rgba, _, _ = bl.render(scene, 12, scratch)
            ground = np.linspace(0, 1, 384)[:, None, None] * rng.uniform(0.02, 0.8, 3) + rng.uniform(0.02, 0.5, 3)
            portrait = display(rgba[..., :3] + ground * (1 - rgba[..., 3:]), 1.0)
            if rng.random() < 0.5:
                y = int(rng.choice([20, 330]))
                cv2.rectangle(portrait, (20, y), (270, y + 30), [int(v) for v in rng.integers(0, 255, 3)], -1)
            cv2.imwrite(str(work / "textures" / f"{portrait_name(split, k)}.png"), portrait[..., ::-1])
            progress.step()
