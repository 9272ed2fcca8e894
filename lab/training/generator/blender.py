"""Blender through `bpy`: scene settings, materials, simple solids, the straight-down panoramic camera, and one render."""

import contextlib
import glob
import math
import os

os.environ["OPENCV_IO_ENABLE_OPENEXR"] = "1"
import bpy  # isort: skip  # First: bmesh exists only once bpy is imported.
import bmesh
import cv2
import numpy as np
from mathutils import Matrix


def setup(threads: int):
    """An empty Cycles scene on the CPU with depth and object-index passes and a transparent film."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.render.engine = "CYCLES"
    scene.render.threads_mode, scene.render.threads = "FIXED", threads
    c = scene.cycles
    c.device, c.max_bounces, c.diffuse_bounces, c.glossy_bounces = "CPU", 3, 2, 1
    c.transparent_max_bounces, c.transmission_bounces = 12, 0
    c.caustics_reflective = c.caustics_refractive = False
    c.sample_clamp_indirect, c.blur_glossy = 3, 1
    c.use_denoising, c.denoiser, c.denoising_prefilter = True, "OPENIMAGEDENOISE", "FAST"
    c.denoising_input_passes = "RGB_ALBEDO_NORMAL"
    c.use_adaptive_sampling = True
    scene.view_settings.view_transform = "Raw"
    layer = scene.view_layers[0]
    layer.use_pass_object_index = layer.use_pass_z = True
    scene.render.use_persistent_data = True
    scene.render.film_transparent = True
    return scene


def clear():
    for block in (bpy.data.objects, bpy.data.meshes, bpy.data.lights, bpy.data.cameras, bpy.data.materials):
        bpy.data.batch_remove([*block])
    _materials.clear()
    _meshes.clear()


def link(item):
    bpy.context.scene.collection.objects.link(item)
    return item


_images, _materials, _meshes = {}, {}, {}


def image(path, data=False):
    if (path, data) not in _images:
        loaded = bpy.data.images.load(path)
        loaded.use_fake_user = True
        if data:
            loaded.colorspace_settings.name = "Non-Color"
        loaded.alpha_mode = "CHANNEL_PACKED"
        _images[path, data] = loaded
    return _images[path, data]


def material(
    colour=(0.5, 0.5, 0.5),
    rough=0.6,
    texture=None,
    scale=1.0,
    emit=0.0,
    metal=0.0,
    tint=None,
    specular=0.3,
    uv=False,
    hsv=None,
    alpha=False,
    normal=None,
    uv_scale=None,
):
    """A Principled material. `texture` is box-projected in meters unless `uv`; `hsv` and `tint` recolor it."""
    key = (
        tuple(colour),
        rough,
        texture,
        scale,
        emit,
        metal,
        tint and tuple(tint),
        specular,
        uv,
        hsv,
        alpha,
        normal,
        uv_scale,
    )
    if key in _materials:
        return _materials[key]
    made = bpy.data.materials.new("m")
    made.use_nodes = True
    tree = made.node_tree
    shader = tree.nodes["Principled BSDF"]
    for name, value in (
        ("Base Color", (*colour, 1)),
        ("Roughness", rough),
        ("Metallic", metal),
        ("Specular IOR Level", specular),
    ):
        shader.inputs[name].default_value = value
    if texture:
        node, where = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeTexCoord")
        node.image = image(texture)
        mapping = tree.nodes.new("ShaderNodeMapping")
        if uv:
            mapping.inputs["Scale"].default_value = (uv_scale or 1,) * 3
            tree.links.new(where.outputs["UV"], mapping.inputs["Vector"])
        else:
            node.projection, node.projection_blend = "BOX", 0.05
            mapping.inputs["Scale"].default_value = (1 / scale,) * 3
            tree.links.new(where.outputs["Object"], mapping.inputs["Vector"])
        tree.links.new(mapping.outputs["Vector"], node.inputs["Vector"])
        out = node.outputs["Color"]
        if hsv:
            change = tree.nodes.new("ShaderNodeHueSaturation")
            for name, value in zip(("Hue", "Saturation", "Value"), hsv):
                change.inputs[name].default_value = value
            tree.links.new(out, change.inputs["Color"])
            out = change.outputs["Color"]
        if tint is not None:
            product = tree.nodes.new("ShaderNodeVectorMath")
            product.operation, product.inputs[1].default_value = "MULTIPLY", tint
            tree.links.new(out, product.inputs[0])
            out = product.outputs[0]
        tree.links.new(out, shader.inputs["Base Color"])
        if emit:
            tree.links.new(out, shader.inputs["Emission Color"])
        if alpha:
            tree.links.new(node.outputs["Alpha"], shader.inputs["Alpha"])
    elif emit:
        shader.inputs["Emission Color"].default_value = (*colour, 1)
    if emit:
        shader.inputs["Emission Strength"].default_value = emit
    if normal:
        node, bump = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeNormalMap")
        node.image = image(normal, True)
        tree.links.new(node.outputs["Color"], bump.inputs["Color"])
        tree.links.new(bump.outputs["Normal"], shader.inputs["Normal"])
    _materials[key] = made
    return made


class Builder:
    """Simple solids in a local frame at (x, y, z), turned by `degrees` about the vertical."""

    def __init__(self, x=0.0, y=0.0, degrees=0.0, z=0.0, index=0, matrix=None):
        self.matrix = matrix or Matrix.Translation((x, y, z)) @ Matrix.Rotation(math.radians(degrees), 4, "Z")
        self.index = index

    def _mesh(self, made, shape, build, smooth=None):
        """The mesh of a shape and material: equal solids share one, which keeps large rooms small."""
        key = (made, *(round(v, 3) if isinstance(v, float) else v for v in shape))
        if key not in _meshes:
            mesh, b = bpy.data.meshes.new(shape[0]), bmesh.new()
            build(b)
            b.to_mesh(mesh)
            b.free()
            if smooth is not None:
                mesh.polygons.foreach_set("use_smooth", [smooth(p) for p in mesh.polygons])
            mesh.materials.append(made)
            _meshes[key] = mesh
        return _meshes[key]

    def _place(self, mesh, x, y, z, rx=0.0, ry=0.0, rz=0.0):
        item = link(bpy.data.objects.new("solid", mesh))
        item.matrix_world = (
            self.matrix
            @ Matrix.Translation((x, y, z))
            @ Matrix.Rotation(rz, 4, "Z")
            @ Matrix.Rotation(ry, 4, "Y")
            @ Matrix.Rotation(rx, 4, "X")
        )
        item.pass_index = self.index
        return item

    def box(self, sx, sy, sz, x, y, z, made, bevel=0.01, rx=0.0, ry=0.0, rz=0.0):
        def build(b):
            bmesh.ops.create_cube(b, size=1)
            bmesh.ops.scale(b, vec=(sx, sy, sz), verts=b.verts)
            if bevel and min(sx, sy, sz) > 2.2 * bevel:
                bmesh.ops.bevel(
                    b,
                    geom=b.edges[:] + b.verts[:],
                    offset=bevel,
                    segments=1 if bevel < 0.03 else 3,
                    affect="EDGES",
                    profile=0.5,
                )

        mesh = self._mesh(made, ("box", sx, sy, sz, bevel), build, (lambda _: True) if bevel >= 0.03 else None)
        return self._place(mesh, x, y, z, rx, ry, rz)

    def cylinder(self, radius, height, x, y, z, made, top=None, segments=16, rx=0.0, ry=0.0, scale=(1, 1), capped=True):
        def build(b):
            bmesh.ops.create_cone(
                b,
                cap_ends=capped,
                segments=segments,
                radius1=radius,
                radius2=radius if top is None else top,
                depth=height,
            )
            bmesh.ops.scale(b, vec=(*scale, 1), verts=b.verts)

        mesh = self._mesh(
            made,
            ("cylinder", radius, height, top, segments, scale, capped),
            build,
            lambda p: len(p.vertices) == 4,
        )
        return self._place(mesh, x, y, z, rx, ry)

    def sphere(self, radius, x, y, z, made, scale=(1, 1, 1), lower=-1.0, rx=0.0):
        """An ellipsoid; what lies below `lower` (in radii) is cut off."""

        def build(b):
            bmesh.ops.create_uvsphere(b, u_segments=16, v_segments=10, radius=radius)
            bmesh.ops.delete(b, geom=[v for v in b.verts if v.co.z < lower * radius], context="VERTS")
            bmesh.ops.scale(b, vec=scale, verts=b.verts)

        return self._place(self._mesh(made, ("sphere", radius, scale, lower), build, lambda _: True), x, y, z, rx)

    def plane(self, sx, sy, x, y, z, made, rx=0.0, ry=0.0, rz=0.0):
        mesh = bpy.data.meshes.new("plane")
        mesh.from_pydata(
            [(-sx / 2, -sy / 2, 0), (sx / 2, -sy / 2, 0), (sx / 2, sy / 2, 0), (-sx / 2, sy / 2, 0)],
            [],
            [(0, 1, 2, 3)],
        )
        mesh.uv_layers.new().data.foreach_set("uv", [0, 0, 1, 0, 1, 1, 0, 1])
        mesh.materials.append(made)
        return self._place(mesh, x, y, z, rx, ry, rz)

    def xy(self, x, y):
        at = (self.matrix @ Matrix.Translation((x, y, 0))).translation
        return at.x, at.y

    def degrees(self):
        return math.degrees(self.matrix.to_euler().z)

    def child(self, x, y, degrees=0.0, index=None):
        return Builder(*self.xy(x, y), self.degrees() + degrees, index=self.index if index is None else index)


def area_light(x, y, z, width, depth, power, colour, rotation=None):
    data = bpy.data.lights.new("area", "AREA")
    data.shape, data.size, data.size_y, data.energy, data.color = "RECTANGLE", width, depth, power, colour
    item = link(bpy.data.objects.new("area", data))
    item.location = (x, y, z)
    if rotation is not None:
        item.rotation_euler = rotation
    item.visible_camera = False
    return item


def ambient(strength, colour):
    shader = bpy.context.scene.world.node_tree.nodes["Background"]
    shader.inputs[0].default_value, shader.inputs[1].default_value = (*colour, 1), strength
    bpy.context.scene.world.cycles_visibility.camera = False


def straight_down_camera(scene, x, y, height, yaw, focal, max_theta):
    """An equidistant camera looking down; the image's up is the direction `yaw` left of +y. Returns the image's side."""
    data = bpy.data.cameras.new("camera")
    item = link(bpy.data.objects.new("camera", data))
    item.location, item.rotation_euler = (x, y, height), (0, 0, yaw)
    scene.camera = item
    data.type, data.clip_start, data.clip_end = "PANO", 0.01, 200
    side = int(math.ceil(2 * focal * max_theta))
    data.panorama_type, data.fisheye_fov = "FISHEYE_EQUIDISTANT", side / focal
    data.sensor_fit, data.sensor_width = "HORIZONTAL", 36.0
    scene.render.resolution_x = scene.render.resolution_y = side
    scene.render.resolution_percentage = 100
    return side


@contextlib.contextmanager
def quiet():
    """Hides Blender's own output: a line for every step of every render."""
    kept, sink = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(sink, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(sink)


def render(scene, samples, scratch, border=None, threshold=0.08):
    """Renders; returns linear RGBA (premultiplied, float32), the distance along each ray (0: nothing hit), the object index.

    `border` is (left, top, right, bottom) in whole pixels of the image.
    """
    r, c = scene.render, scene.cycles
    c.samples, c.adaptive_threshold, c.adaptive_min_samples = samples, threshold, max(4, samples // 2)
    c.pixel_filter_type, c.filter_width = "BLACKMAN_HARRIS", 1.5
    r.use_border = r.use_crop_to_border = border is not None
    if border is not None:
        side = r.resolution_x
        r.border_min_x, r.border_max_x = border[0] / side, border[2] / side
        r.border_min_y, r.border_max_y = 1 - border[3] / side, 1 - border[1] / side
    scene.use_nodes, r.use_compositing = True, True
    tree = scene.node_tree
    if "passes" not in tree.nodes:
        tree.nodes.clear()
        layers, out = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("CompositorNodeOutputFile")
        out.name = "passes"
        out.format.file_format, out.format.color_mode, out.format.color_depth, out.format.exr_codec = (
            "OPEN_EXR",
            "RGBA",
            "32",
            "NONE",
        )
        out.file_slots.clear()
        for name in ("Image", "Depth", "IndexOB"):
            out.file_slots.new(name)
            tree.links.new(layers.outputs[name], out.inputs[name])
        tree.links.new(layers.outputs["Image"], tree.nodes.new("CompositorNodeComposite").inputs[0])
    tree.nodes["passes"].base_path = scratch
    with quiet():
        bpy.ops.render.render(write_still=False)
    passes = {}
    for name in ("Image", "Depth", "IndexOB"):
        path = glob.glob(f"{scratch}/{name}*.exr")[0]
        passes[name] = cv2.imread(path, cv2.IMREAD_UNCHANGED)
        os.remove(path)
    flat = lambda a: a if a.ndim == 2 else a[..., 2]
    rgba = passes["Image"][..., [2, 1, 0, 3]]
    depth = flat(passes["Depth"]).copy()
    depth[depth > 190] = 0
    return rgba, depth, np.rint(flat(passes["IndexOB"])).astype(np.uint8)
