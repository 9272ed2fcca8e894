"""Renders pieces alone, from many heights and distances, into packed crops: `WORK/persons/SPLIT/SEED.npz`.

A crop is a rectangle of the panorama (geometry.py) about the piece at azimuth 0: linear color with alpha, distance, and the
index of the person (0: furniture). One file a body group; every view has another outfit. Finished files are skipped.
"""

import json
import math
import os
import tempfile

import bpy
import cv2
import numpy as np

from . import blender as bl
from .body import Body
from .crops import encode_radiance
from .geometry import panorama_bounds, panorama_of
from .pieces import Maker, make_piece
from .progress import Progress
from .scene import HEIGHT_SHARES, HEIGHTS, floor_irradiance
from .wardrobe import random_colours

VIEWS = 10
FARTHEST = 18.0
"""Meters on the floor."""
LONGEST_SIDE = 250
"""Pixels: crops are at most about so long, but never coarser than 220 pixels a radian."""
LIGHTS = {"soft": 0.5, "side": 0.22, "sun": 0.16, "infrared": 0.12}


def random_viewpoint(rng, k):
    """Camera height, distance on the floor, bearing, and pixels a radian."""
    height = float(HEIGHTS[rng.choice(len(HEIGHTS), p=HEIGHT_SHARES)] * rng.uniform(0.92, 1.08))
    if k == 0:
        theta = rng.uniform(0, 20)
    else:
        theta = rng.uniform(*((12, 42), (40, 68), (66, 84))[rng.choice(3, p=[0.25, 0.5, 0.25])])
    distance = height * math.tan(math.radians(theta))
    return height, min(distance, FARTHEST), float(rng.uniform(0, 2 * math.pi))


def light_rig(rng, kind, camera):
    """Lights a piece at the origin; returns the irradiance on the floor there."""
    for item in [o for o in bpy.data.objects if o.type == "LIGHT"]:
        bpy.data.objects.remove(item)
    tint = (1.0, float(rng.uniform(0.88, 1.0)), float(rng.uniform(0.72, 1.05)))
    ambient, lights = float(rng.uniform(0.25, 0.7)), []
    if kind == "infrared":
        ambient = 0.03
        bl.area_light(
            *camera,
            0.1,
            0.1,
            60 * (camera[0] ** 2 + camera[1] ** 2 + camera[2] ** 2),
            (1, 1, 1),
            rotation=(
                math.atan2(math.hypot(camera[0], camera[1]), camera[2]),
                0,
                math.atan2(-camera[0], camera[1]) + math.pi,
            ),
        )
    else:
        z = float(rng.uniform(2.6, 6))
        for _ in range(int(rng.integers(1, 5))):
            x, y, power = (
                float(rng.uniform(-3, 3)),
                float(rng.uniform(-3, 3)),
                float(rng.uniform(15, 60)) * (z / 2.7) ** 2,
            )
            bl.area_light(x, y, z, 0.6, 1.0, power, tint)
            lights.append((x, y, z, power))
    bl.ambient(ambient, tint)
    total = floor_irradiance(lights, ambient)
    if kind in ("side", "sun"):
        data = bpy.data.lights.new("sun", "SUN")
        data.energy, data.angle = (
            float(rng.uniform(2, 5) if kind == "sun" else rng.uniform(0.8, 2)),
            math.radians(0.6 if kind == "sun" else 40),
        )
        item = bl.link(bpy.data.objects.new("sun", data))
        item.rotation_euler = (float(rng.uniform(0.5, 1.2)), 0, float(rng.uniform(0, 6.28)))
    if kind == "infrared":
        total = math.pi * ambient + 60 / math.pi  # On a surface that faces the lamp beside the lens.
    return total


def whole_area(points, triangles):
    """Pixels that a body covers when nothing stands before it: what the visible share is counted from."""
    fine = 4 if np.ptp(points, axis=0).max() < 120 else 2  # Filled triangles include the pixels that they touch.
    low = np.floor(points.min(0)) - 1
    size = (np.ceil(points.max(0) - low).astype(int) + 2) * fine
    mask, corners = np.zeros(size[::-1], np.uint8), np.rint((points - low) * fine * 16).astype(np.int32)
    for corner in corners[triangles]:
        cv2.fillConvexPoly(mask, corner, 1, cv2.LINE_8, 4)
    return max(1, round(int(mask.sum()) / fine**2))


def render_group(scene, body, seed, work, split, scratch, samples):
    """Renders all views of one random piece; returns the arrays of its file."""
    rng = np.random.default_rng(seed)
    bl.clear()
    textures = work / "textures"
    maker = Maker(body, rng, work / "assets", textures, split)
    name = make_piece(maker)
    ground = bl.Builder().plane(
        60, 60, 0, 0, 0, bl.material(tuple(float(x) for x in rng.uniform(0.15, 0.5) * np.ones(3)), 0.9)
    )
    ground.visible_camera = False
    for figure in maker.figures:
        figure.wear_extras(random_colours(rng, figure.who, split), maker.palette)
    points = np.concatenate([figure.world_vertices() for figure in maker.figures])
    solids = [
        np.array(o.matrix_world @ v.co)
        for o in bpy.data.objects
        if o.type == "MESH" and o != ground and len(o.data.vertices) < 2000
        for v in o.data.vertices
    ]
    outline = np.concatenate([points] + ([np.array(solids)] if solids else []))
    arrays, views = {}, []
    for k in range(VIEWS):
        for figure in maker.figures:
            figure.colour(random_colours(rng, figure.who, split), textures)
        height, distance, bearing = random_viewpoint(rng, k)
        light = str(rng.choice(list(LIGHTS), p=list(LIGHTS.values())))
        at = (distance * math.sin(bearing), -distance * math.cos(bearing), height)
        turn = np.array(
            [[math.cos(bearing), math.sin(bearing), 0], [-math.sin(bearing), math.cos(bearing), 0], [0, 0, 1]]
        ).T
        turned = outline @ turn + (0, distance, 0)
        size = max(np.ptp(np.array(panorama_bounds(turned, height, 1000.0, 0)).reshape(2, 2), axis=0)) / 1000
        focal = float(np.clip(LONGEST_SIDE / size, 220, 400))
        left, top, right, bottom = panorama_bounds(turned, height, focal)
        white = light_rig(rng, light, at) / math.pi
        for item in [o for o in bpy.data.objects if o.type == "CAMERA"]:
            bpy.data.objects.remove(item)
        side = bl.straight_down_camera(scene, *at, bearing, focal, math.radians(115))
        half = side // 2
        scene.cycles.seed = (seed + k) % 100000
        border = (max(0, half + left), max(0, half + top), min(side, half + right), min(side, half + bottom))
        rgba, depth, index = bl.render(scene, samples, scratch, border)
        arrays[f"colour{k}"] = encode_radiance(rgba[..., :3] / white)
        arrays[f"alpha{k}"] = np.rint(np.clip(rgba[..., 3], 0, 1) * 255).astype(np.uint8)
        arrays[f"depth{k}"] = np.clip(np.rint(depth * 1000), 0, 65535).astype(np.uint16)
        arrays[f"index{k}"] = index
        views.append(
            dict(
                camera_height=height,
                distance=distance,
                bearing=bearing,
                focal=focal,
                light=light,
                left=border[0] - (side - 1) / 2,
                top=border[1] - (side - 1) / 2,
                whole={
                    f.index: whole_area(
                        panorama_of(f.world_vertices() @ turn + (0, distance, 0), height, focal), f.triangles
                    )
                    for f in maker.figures
                },
            )
        )
    step = max(1, len(outline) // 1500)
    arrays["cloud"] = outline[rng.permutation(len(outline))[::step]].astype(np.float16)
    about = dict(
        seed=seed,
        split=split,
        piece=name,
        views=views,
        reach=float(np.hypot(outline[:, 0], outline[:, 1]).max()),
        persons=[
            dict(
                index=f.index,
                kind=f.kind,
                arms=f.arms,
                child=f.who["child"],
                stature=f.who["stature"],
                sex=f.who["sex"],
                suit=f.who["suit"],
                extras=f.who["extras"],
                x=float(f.matrix.translation.x),
                y=float(f.matrix.translation.y),
                heading=f.degrees,
            )
            for f in maker.figures
        ],
    )
    arrays["about"] = np.frombuffer(json.dumps(about).encode(), np.uint8)
    return arrays


def render_persons(work, first_seed, count, split="train", threads=1, samples=12):
    """Renders `count` groups of VIEWS crops each, skipping those that exist."""
    folder = work / "persons" / split
    folder.mkdir(parents=True, exist_ok=True)
    todo = [s for s in range(first_seed, first_seed + count) if not (folder / f"{s}.npz").exists()]
    progress = Progress(f"persons {split}", len(todo), work / "log" / f"persons-{split}.log")
    body, scene = Body(work / "assets" / "body"), bl.setup(threads)
    with tempfile.TemporaryDirectory(dir="/dev/shm" if os.path.isdir("/dev/shm") else None) as scratch:
        for seed in todo:
            arrays = render_group(scene, body, seed, work, split, scratch, samples)
            partial = folder / f"{seed}.partial.npz"
            np.savez_compressed(partial, **arrays)
            partial.rename(folder / f"{seed}.npz")
            progress.step()
