"""Persons as Blender objects: meshes with recolored clothes, and what they wear and carry beyond MakeHuman's clothes."""

import math

import bpy
import numpy as np
from mathutils import Matrix

from .blender import Builder, link, material
from .furniture import suitcase
from .pose import random_pose
from .wardrobe import EXTRAS

WAIST = 0.60
"""Share of the stature at which a suit's texture changes from trousers to top."""


class Figure:
    """One person in the scene, with its vertices for boxes and shadows."""

    def __init__(self, person, who, index, x, y, degrees, z=0.0):
        self.person, self.who, self.index, self.extras = person, who, index, []
        self.matrix = Matrix.Translation((x, y, z)) @ Matrix.Rotation(math.radians(degrees), 4, "Z")
        self._slots = []
        vertices, faces, uv, slots, offset = [], [], [], [], 0
        for part in person.parts:
            vertices.append(part.vertices)
            for face, uv_face in zip(part.faces, part.uv_faces):
                faces.append([v + offset for v in face])
                uv += [part.uv[t] for t in uv_face]
                upper = part.kind == "cloth" and part.rest_height[list(face)].mean() > WAIST
                slots.append(self._slot(part, upper))
            offset += len(part.vertices)
        mesh = bpy.data.meshes.new("figure")
        self.vertices = np.concatenate(vertices)
        self.triangles = np.array([(f[0], f[a], f[a + 1]) for f in faces for a in range(1, len(f) - 1)])
        mesh.from_pydata(self.vertices.tolist(), [], faces)
        mesh.uv_layers.new().data.foreach_set("uv", np.array(uv, np.float32).ravel())
        mesh.polygons.foreach_set("material_index", slots)
        mesh.polygons.foreach_set("use_smooth", [True] * len(faces))
        for _ in self._slots:
            mesh.materials.append(None)
        self.object = link(bpy.data.objects.new("figure", mesh))
        self.object.matrix_world, self.object.pass_index = self.matrix, index

    def _slot(self, part, upper):
        key = (part.kind, upper, part.texture, part.normal_map)
        if key not in self._slots:
            self._slots.append(key)
        return self._slots.index(key)

    def world_vertices(self):
        m = np.array(self.matrix)
        return self.vertices @ m[:3, :3].T + m[:3, 3]

    def lift(self, dz):
        self.matrix = Matrix.Translation((0, 0, dz)) @ self.matrix
        self.object.matrix_world = self.matrix
        for item in self.extras:
            item.location.z += dz

    def colour(self, colours, textures):
        """Gives every slot a material of these colors: the same body in another outfit."""
        for i, (kind, upper, texture, normal) in enumerate(self._slots):
            if kind == "skin":
                made = material(tuple(colours["skin"]), 0.5, specular=0.35)
            elif kind == "eye":
                made = material((0.5, 0.45, 0.4), 0.3)
            elif kind == "hair":
                made = (
                    material(texture=texture, uv=True, rough=0.45, tint=colours["hair"], alpha=True)
                    if texture
                    else material(tuple(0.25 * c for c in colours["hair"]), 0.6)
                )
            else:
                g = colours["top"] if upper else colours["bottom"]
                if kind == "cloth" and (g["fabric"] is not None or texture is None):
                    tone = hsv_to_rgb(g["hue"], min(1.0, g["saturation"]), 2.2 * g["value"])
                    made = material(
                        texture=f"{textures}/fabric{g['fabric'] or 0}.png",
                        uv=True,
                        rough=0.85,
                        specular=0.2,
                        tint=tone,
                        uv_scale=3.0,
                        normal=normal,
                    )
                elif texture is None:
                    made = material((0.05, 0.05, 0.05), 0.6)
                else:
                    made = material(
                        texture=texture,
                        uv=True,
                        rough=0.85,
                        specular=0.2,
                        hsv=(g["hue"], g["saturation"], g["value"]),
                        alpha=True,
                        normal=normal,
                    )
            self.object.material_slots[i].material = made

    def wear_extras(self, colours, palette):
        """Adds bags, hats, coats and skirts. Worn things belong to the person; boxes and suitcases do not."""
        j, k, index = self.person.joints, self.who["stature"] / 1.75, self.index
        before = set(bpy.data.objects)
        b = Builder(matrix=self.matrix, index=index)
        tone = {name: material(tuple(colours["extra"][i]), 0.8) for i, name in enumerate(EXTRAS)}
        for i, name in enumerate(EXTRAS):
            if name in ("skirt", "long_coat", "scarf", "backpack") and (fabric := colours["extra_fabric"]) is not None:
                tone[name] = material(
                    texture=f"{palette.textures}/fabric{fabric}.png",
                    rough=0.9,
                    scale=0.5,
                    tint=tuple(2 * c for c in colours["extra"][i]),
                )
        upright = self.person.rotations["spine02"]
        back = upright @ np.array([0, 0, -1.0])
        back = np.array([back[0], -back[2], back[1]])
        shoulder = (j["upperarm01.L"] + j["upperarm01.R"]) / 2
        lean = math.atan2(-back[2], back[1]) if back[1] > 0.2 else 0.0
        crown = self.person.parts
        head = j["head"] + np.array([0, -0.02, 0.09]) * k
        top = max(float(p.vertices[:, 2].max()) for p in crown if p.kind in ("skin", "hair", "cloth"))
        sitting = j["upperleg01.L"][2] < 0.42 * self.who["stature"]
        for name in self.who["extras"]:
            if name == "backpack":
                at = shoulder * 0.45 + j["spine02"] * 0.55 + back * 0.2 * k
                b.box(0.3 * k, 0.17 * k, 0.42 * k, *at, tone[name], bevel=0.05, rx=-lean)
            elif name == "shoulder_bag":
                side = 1 if colours["extra"][0][0] > 0.2 else -1
                hip = j["upperleg01.L" if side > 0 else "upperleg01.R"]
                b.box(
                    0.1 * k,
                    0.32 * k,
                    0.24 * k,
                    hip[0] + side * 0.16 * k,
                    hip[1],
                    hip[2] + 0.02,
                    tone[name],
                    bevel=0.03,
                )
            elif name in ("cap", "hood", "helmet"):
                size = {"cap": 0.1, "hood": 0.12, "helmet": 0.118}[name] * (0.9 + 0.1 * k)
                b.sphere(
                    size,
                    head[0],
                    head[1],
                    min(head[2] + 0.02, top - size * 0.75),
                    tone[name],
                    scale=(0.92, 1.12, 1.0),
                    lower=-0.05 if name != "hood" else -0.75,
                )
                if name == "cap":
                    b.box(
                        0.14,
                        0.1,
                        0.012,
                        head[0],
                        head[1] - 0.14,
                        min(head[2] + 0.03, top - 0.07),
                        tone[name],
                        bevel=0,
                    )
            elif name == "scarf":
                b.cylinder(
                    0.085 * k,
                    0.09 * k,
                    *(j["neck01"] + np.array([0, -0.02, 0.03]) * k),
                    tone[name],
                    top=0.075 * k,
                )
            elif name in ("skirt", "long_coat") and not sitting:
                hips = (j["upperleg01.L"] + j["upperleg01.R"]) / 2
                low = hips[2] * (0.5 if colours["extra"][1][0] > 0.2 else 0.2)
                stride = float(np.hypot(*(j["foot.L"] - j["foot.R"])[:2]))
                low = max(low, 0.42 * hips[2]) if stride > 0.45 * k else low  # Long skirts do not allow long steps.
                feet = max(0.16, 0.12 + 0.42 * stride * (1 - low / hips[2]))
                high = hips[2] + 0.12 * k
                b.cylinder(
                    feet * 1.35 * k,
                    high - low,
                    hips[0],
                    hips[1] - 0.02,
                    (high + low) / 2,
                    tone[name],
                    top=0.16 * k,
                    segments=20,
                    scale=(1, 0.85),
                    capped=False,
                )
            elif name == "vest":
                mid = shoulder * 0.5 + (j["upperleg01.L"] + j["upperleg01.R"]) / 4
                b.cylinder(
                    0.185 * k,
                    0.5 * k,
                    *mid,
                    material((0.75, 0.55 * colours["extra"][2][0] + 0.2, 0.02), 0.7),
                    top=0.2 * k,
                    scale=(1.0, 0.75),
                    rx=-lean,
                    capped=False,
                )
            elif name == "box":
                hands = (j["wrist.L"] + j["wrist.R"]) / 2
                Builder(matrix=self.matrix).box(
                    0.36,
                    0.28,
                    0.26,
                    hands[0],
                    hands[1] - 0.12,
                    hands[2] + 0.05,
                    material((0.42, 0.3, 0.18), 0.9),
                    bevel=0.005,
                )
            elif name == "suitcase":
                hand = j["wrist.L"]
                s = Builder(matrix=self.matrix @ Matrix.Translation((hand[0] + 0.15, hand[1] + 0.3, 0)))
                suitcase(s, palette)
        self.extras = [o for o in bpy.data.objects if o not in before]


def hsv_to_rgb(h, s, v):
    i, f = int(h * 6) % 6, h * 6 % 1
    p, q, t = v * (1 - s), v * (1 - s * f), v * (1 - s * (1 - f))
    return tuple(round(x, 3) for x in [(v, t, p), (q, v, p), (p, v, t), (p, q, v), (t, p, v), (v, p, q)][i])


def add_figure(body, rng, who, kind, index, x=0.0, y=0.0, degrees=0.0, arms=None, seat_height=None):
    """Builds, poses and places a person. `seat_height` lifts a sitting person so that the thighs rest on the seat."""
    if "box" in who["extras"]:
        arms = "carry"
    pose, arms = random_pose(kind, rng, arms)
    figure = Figure(body.build(who, pose), who, index, x, y, degrees)
    figure.kind, figure.arms, figure.degrees = kind, arms, degrees
    if seat_height is not None:
        figure.lift(max(0.0, seat_height - natural_seat(figure)))
    return figure


def natural_seat(figure):
    """The height under the thighs of a sitting person with the feet on the floor."""
    j = figure.person.joints
    return float(min(j["upperleg01.L"][2], j["upperleg01.R"][2]) - 0.075 * figure.who["stature"] / 1.7)
