"""MakeHuman's base mesh as a posed, dressed person: shape targets, clothes fitted to the shape, and linear skinning.

Frame of the body: x to the person's left, y up, z to the front, in decimetres. `Person` is in meters: x, -z, y, so that
the person faces the negative y axis with the feet on z = 0.
"""

import gzip
import json
import os
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

JOINTS = (
    "root",
    "spine02",
    "head",
    "neck01",
    "foot.L",
    "foot.R",
    "wrist.L",
    "wrist.R",
    "upperleg01.L",
    "upperleg01.R",
    "lowerleg01.L",
    "lowerleg01.R",
    "upperarm01.L",
    "upperarm01.R",
)
NEXT_JOINT = {
    "upperarm01": "lowerarm01",
    "lowerarm01": "wrist",
    "upperleg01": "lowerleg01",
    "lowerleg01": "foot",
}


@dataclass
class Part:
    """One textured mesh of a person: skin, hair, cloth, shoe or eye."""

    kind: str
    vertices: np.ndarray
    faces: list
    uv_faces: list
    uv: np.ndarray
    texture: str | None
    normal_map: str | None
    rest_height: np.ndarray
    """Height of each vertex in the rest pose as a share of the stature: separates shirt from trousers."""


@dataclass
class Person:
    parts: list
    joints: dict
    rotations: dict = field(default_factory=dict)


def load_obj(path):
    vertices, uv, faces, uv_faces, groups, group = [], [], [], [], [], ""
    with open(path, errors="ignore") as lines:
        for line in lines:
            if line.startswith("v "):
                vertices.append([float(x) for x in line.split()[1:4]])
            elif line.startswith("vt "):
                uv.append([float(x) for x in line.split()[1:3]])
            elif line.startswith("g "):
                group = line.split()[1]
            elif line.startswith("f "):
                corners = [x.split("/") for x in line.split()[1:]]
                faces.append([int(x[0]) - 1 for x in corners])
                uv_faces.append([int(x[1]) - 1 if len(x) > 1 and x[1] else 0 for x in corners])
                groups.append(group)
    return np.array(vertices), np.array(uv) if uv else np.zeros((1, 2)), faces, uv_faces, groups


@dataclass
class Garment:
    """A MakeHuman proxy (.mhclo): each vertex hangs on three vertices of the body."""

    scales: dict
    anchors: np.ndarray
    weights: np.ndarray
    offsets: np.ndarray
    hidden: set
    uv: np.ndarray
    faces: list
    uv_faces: list
    texture: str | None
    normal_map: str | None


def _material_textures(folder, material):
    found = {}
    with open(folder / material, errors="ignore") as lines:
        for line in lines:
            words = line.split()
            if len(words) > 1 and words[0] in ("diffuseTexture", "normalmapTexture"):
                path = Path(os.path.normpath((folder / material).parent / words[1]))
                found[words[0]] = str(path) if path.exists() else None  # Textures of unsettled license are absent.
    return found.get("diffuseTexture"), found.get("normalmapTexture")


@cache
def load_garment(path):
    scales, rows, hidden, mode, obj, material = {}, [], set(), "", None, None
    with open(path, errors="ignore") as lines:
        for line in lines:
            words = line.split()
            if not words or words[0].startswith("#"):
                continue
            if words[0] in ("x_scale", "y_scale", "z_scale"):
                scales["xyz".index(words[0][0])] = (int(words[1]), int(words[2]), float(words[3]))
            elif words[0] == "obj_file":
                obj = words[1]
            elif words[0] == "material":
                material = words[1]
            elif words[0] in ("verts", "delete_verts", "weights"):
                mode = words[0]
            elif mode == "verts" and words[0].lstrip("-").isdigit():
                if len(words) == 1:
                    rows.append([int(words[0])] * 3 + [1, 0, 0, 0, 0, 0])
                elif len(words) >= 6:
                    offset = [float(x) for x in words[6:9]] if len(words) >= 9 else [0, 0, 0]
                    rows.append([int(x) for x in words[:3]] + [float(x) for x in words[3:6]] + offset)
            elif mode == "delete_verts":
                i = 0
                while i < len(words):
                    if i + 2 < len(words) and words[i + 1] == "-":
                        hidden.update(range(int(words[i]), int(words[i + 2]) + 1))
                        i += 3
                    else:
                        hidden.add(int(words[i]))
                        i += 1
    rows, folder = np.array(rows), Path(path).parent
    _, uv, faces, uv_faces, _ = load_obj(folder / obj)
    texture, normal_map = _material_textures(folder, material) if material else (None, None)
    return Garment(
        scales,
        rows[:, :3].astype(int),
        rows[:, 3:6],
        rows[:, 6:9],
        hidden,
        uv,
        faces,
        uv_faces,
        texture,
        normal_map,
    )


def rotation_between(a, b):
    """The smallest rotation that takes direction a to direction b."""
    a = a / np.linalg.norm(a)
    b = np.asarray(b, float) / np.linalg.norm(b)
    v, c = np.cross(a, b), a @ b
    k = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + k + k @ k / (1 + c + 1e-9)


def _shares(x, low, middle, high):
    return {middle: 1 - abs(x), (high if x > 0 else low): abs(x)} if x else {middle: 1.0}


class Body:
    """The base mesh with its rig; `build` makes a `Person` of a description and a pose."""

    def __init__(self, folder):
        self.folder = Path(folder)
        self.rest, self.uv, self.faces, self.uv_faces, self.groups = load_obj(self.folder / "3dobjs/base.obj")
        rig = json.loads((self.folder / "rigs/standard/rig.default.json").read_text())
        self.rig = rig.get("bones", rig)
        self.joint_cubes = {}
        for face, group in zip(self.faces, self.groups):
            if group.startswith("joint-"):
                self.joint_cubes.setdefault(group, set()).update(face)
        self.names = []
        for name in self.rig:
            self._add_bone(name)
        self.index = {name: i for i, name in enumerate(self.names)}
        self.parents = [self.index[p] if (p := self.rig[n].get("parent")) else -1 for n in self.names]
        weights = json.loads((self.folder / "rigs/standard/weights.default.json").read_text())["weights"]
        skin = np.zeros((len(self.rest), len(self.names)), np.float32)
        for name, pairs in weights.items():
            if name in self.index:
                for i, weight in pairs:
                    skin[i, self.index[name]] = weight
        skin[skin.sum(1) == 0, self.index["root"]] = 1
        self.skin = skin / skin.sum(1)[:, None]
        self.body_vertices = np.unique(
            np.concatenate([np.array(f) for f, g in zip(self.faces, self.groups) if g == "body"])
        )

    def _add_bone(self, name):
        if name in self.names:
            return
        if parent := self.rig[name].get("parent"):
            self._add_bone(parent)
        self.names.append(name)

    @cache
    def target(self, name):
        path, indices, moves = self.folder / f"targets/{name}.target.gz", [], []
        if path.exists():
            for line in gzip.open(path, "rt"):
                words = line.split()
                if len(words) == 4 and not line.startswith("#"):
                    indices.append(int(words[0]))
                    moves.append([float(x) for x in words[1:]])
        return np.array(indices, int), np.array(moves).reshape(-1, 3)

    def shape(self, who):
        """The rest mesh of a description: sum of the macro targets by age, sex, ancestry, muscle, weight."""
        vertices = self.rest.copy()
        for age, age_share in who["ages"].items():
            names = [(f"macrodetails/{who['ancestry']}-{who['sex']}-{age}", age_share)]
            for muscle, m in _shares(who["muscle"], "minmuscle", "averagemuscle", "maxmuscle").items():
                for weight, w in _shares(who["weight"], "minweight", "averageweight", "maxweight").items():
                    tail = f"{who['sex']}-{age}-{muscle}-{weight}"
                    names.append((f"macrodetails/universal-{tail}", age_share * m * w))
                    names.append(
                        (
                            f"macrodetails/proportions/{tail}-idealproportions",
                            age_share * m * w * who["ideal"],
                        )
                    )
            for name, share in names:
                if abs(share) > 1e-3:
                    indices, moves = self.target(name)
                    vertices[indices] += share * moves
        return vertices

    def _heads(self, vertices):
        heads = np.zeros((len(self.names), 3))
        for i, name in enumerate(self.names):
            head = self.rig[name]["head"]
            strategy = head.get("strategy")
            if strategy == "CUBE":
                heads[i] = vertices[sorted(self.joint_cubes[head["cube_name"]])].mean(0)
            elif strategy == "VERTEX":
                heads[i] = vertices[head["vertex_index"]]
            elif strategy == "MEAN":
                heads[i] = vertices[head["vertex_indices"]].mean(0)
            else:
                x, y, z = head["default_position"]
                heads[i] = np.array([x, z, -y]) * 10
        return heads

    def _pose(self, heads, pose):
        rotations, posed = [None] * len(self.names), np.zeros((len(self.names), 3))
        for i, name in enumerate(self.names):
            parent = self.parents[i]
            turn = rotations[parent] if parent >= 0 else np.eye(3)
            kind, value = pose.get(name, ("same", None))
            if kind == "relative":
                turn = turn @ value
            elif kind == "absolute":
                turn = value
            elif kind == "direction":
                bone, side = name.split(".")
                child = heads[self.index[f"{NEXT_JOINT[bone]}.{side}"]] - heads[i]
                turn = rotation_between(turn @ child, value) @ turn
            rotations[i] = turn
            posed[i] = heads[i] if parent < 0 else rotations[parent] @ (heads[i] - heads[parent]) + posed[parent]
        return np.array(rotations), posed

    def build(self, who, pose) -> Person:
        vertices = self.shape(who)
        heads = self._heads(vertices)
        rotations, posed = self._pose(heads, pose)
        moves = posed - np.einsum("bij,bj->bi", rotations, heads)

        def skinned(points, weights):
            mixed = (weights @ rotations.reshape(len(rotations), 9)).reshape(-1, 3, 3)
            return np.einsum("vij,vj->vi", mixed, points) + weights @ moves

        low, high = vertices[self.body_vertices, 1].min(), vertices[self.body_vertices, 1].max()
        share = lambda points: (points[:, 1] - low) / (high - low)
        parts, hidden = [], set()
        for path, kind in who["wear"]:
            g = load_garment(path)
            scale = np.ones(3)
            for axis, (a, b, reference) in g.scales.items():
                scale[axis] = abs(vertices[a, axis] - vertices[b, axis]) / reference
            fitted = np.einsum("vk,vkj->vj", g.weights, vertices[g.anchors]) + g.offsets * scale
            weights = np.maximum(np.einsum("vk,vkb->vb", g.weights, self.skin[g.anchors]), 0)
            weights /= np.maximum(weights.sum(1), 1e-9)[:, None]
            parts.append(
                Part(
                    kind,
                    skinned(fitted, weights),
                    g.faces,
                    g.uv_faces,
                    g.uv,
                    g.texture,
                    g.normal_map,
                    share(fitted),
                )
            )
            hidden |= g.hidden
        posed_skin = skinned(vertices, self.skin)
        shown = [
            i
            for i, (f, g) in enumerate(zip(self.faces, self.groups))
            if g == "body" and not all(v in hidden for v in f)
        ]
        eyes = [i for i, g in enumerate(self.groups) if g in ("helper-l-eye", "helper-r-eye")]
        for kind, chosen in (("skin", shown), ("eye", eyes)):
            used = np.unique(np.concatenate([np.array(self.faces[i]) for i in chosen]))
            renumber = {v: k for k, v in enumerate(used)}
            parts.append(
                Part(
                    kind,
                    posed_skin[used],
                    [[renumber[v] for v in self.faces[i]] for i in chosen],
                    [self.uv_faces[i] for i in chosen],
                    self.uv,
                    None,
                    None,
                    share(vertices[used]),
                )
            )
        origin = np.array(
            [
                posed[self.index["root"]][0],
                min(p.vertices[:, 1].min() for p in parts),
                posed[self.index["root"]][2],
            ]
        )
        metres = who["stature"] / (high - low)
        convert = lambda points: ((points - origin) * metres)[:, [0, 2, 1]] * (1, -1, 1)
        for part in parts:
            part.vertices = convert(part.vertices)
        return Person(
            parts,
            {name: convert(posed[self.index[name]][None])[0] for name in JOINTS},
            {name: rotations[self.index[name]] for name in ("head", "spine02")},
        )
