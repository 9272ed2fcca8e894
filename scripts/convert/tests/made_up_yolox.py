"""YOLOX networks of any width and depth with random weights, and checkpoints in PyTorch's format."""

import collections
import io
import pickle
import sys
import types
import zipfile
from pathlib import Path
from unittest import mock

import numpy


class YoloxWeights:
    """Random weights by the names that YOLOX gives them; `width` is that of the stem, `depth` of the first stage."""

    def __init__(self, width: int, depth: int, classes: int, separable: bool, seed: int):
        self.weights = {}
        self._random = numpy.random.default_rng(seed)
        self._separable = separable
        trunk, wide = "backbone.backbone", [width * factor for factor in (2, 4, 8, 16)]
        self._unit(f"{trunk}.stem.conv", 12, width, 3)
        self.weights[f"{trunk}.stem.conv.conv.weight"] /= 255
        stages, repeated = ("dark2", "dark3", "dark4", "dark5"), (depth, 3 * depth, 3 * depth, depth)
        for stage, before, channels, repeats in zip(stages, [width, *wide[:-1]], wide, repeated, strict=True):
            self._block(f"{trunk}.{stage}.0", before, channels, 3)
            if stage == "dark5":
                self._unit(f"{trunk}.dark5.1.conv1", channels, channels // 2, 1)
                self._unit(f"{trunk}.dark5.1.conv2", channels * 2, channels, 1)
            self._partial(f"{trunk}.{stage}.{2 if stage == 'dark5' else 1}", channels, channels, repeats)
        fine, middle, coarse = wide[1:]
        self._unit("backbone.lateral_conv0", coarse, middle, 1)
        self._partial("backbone.C3_p4", 2 * middle, middle, depth)
        self._unit("backbone.reduce_conv1", middle, fine, 1)
        self._partial("backbone.C3_p3", 2 * fine, fine, depth)
        self._block("backbone.bu_conv2", fine, fine, 3)
        self._partial("backbone.C3_n3", 2 * fine, middle, depth)
        self._block("backbone.bu_conv1", middle, middle, 3)
        self._partial("backbone.C3_n4", 2 * middle, coarse, depth)
        for index, channels in enumerate((fine, middle, coarse)):
            self._unit(f"head.stems.{index}", channels, fine, 1)
            for branch in ("cls_convs", "reg_convs"):
                for place in (0, 1):
                    self._block(f"head.{branch}.{index}.{place}", fine, fine, 3)
            for kind, outputs in (("cls", classes), ("reg", 4), ("obj", 1)):
                self.weights[f"head.{kind}_preds.{index}.weight"] = self._normal(outputs, fine, 1, 1) / fine**0.5
                self.weights[f"head.{kind}_preds.{index}.bias"] = self._normal(outputs)

    def _block(self, name: str, inputs: int, outputs: int, size: int) -> None:
        if self._separable:
            self._unit(f"{name}.dconv", 1, inputs, size)
            self._unit(f"{name}.pconv", inputs, outputs, 1)
        else:
            self._unit(name, inputs, outputs, size)

    def _partial(self, name: str, inputs: int, outputs: int, repeats: int) -> None:
        half = outputs // 2
        for place in ("conv1", "conv2"):
            self._unit(f"{name}.{place}", inputs, half, 1)
        for index in range(repeats):
            self._unit(f"{name}.m.{index}.conv1", half, half, 1)
            self._block(f"{name}.m.{index}.conv2", half, half, 3)
        self._unit(f"{name}.conv3", outputs, outputs, 1)

    def _unit(self, name: str, inputs: int, outputs: int, size: int) -> None:
        spread = (2 / (inputs * size * size)) ** 0.5
        self.weights[f"{name}.conv.weight"] = self._normal(outputs, inputs, size, size) * numpy.float32(spread)
        for part, values in (
            ("weight", self._random.uniform(0.8, 1.2, outputs)),
            ("bias", self._random.normal(0, 0.1, outputs)),
            ("running_mean", self._random.normal(0, 0.1, outputs)),
            ("running_var", self._random.uniform(0.5, 1.5, outputs)),
        ):
            self.weights[f"{name}.bn.{part}"] = values.astype(numpy.float32)

    def _normal(self, *shape: int) -> numpy.ndarray:
        return self._random.standard_normal(shape, numpy.float32)


class _Storage:
    """The encoding of the numbers of a tensor."""

    def __init__(self, values: numpy.ndarray):
        self.values = values


def write_checkpoint(file: Path, content) -> None:
    """Writes the file of `torch.save` for these dicts, lists and arrays, with arrays as tensors."""
    torch, utilities = types.ModuleType("torch"), types.ModuleType("torch._utils")
    torch.FloatStorage = type("FloatStorage", (), {"__module__": "torch"})
    rebuild = types.FunctionType((lambda: None).__code__, {}, "_rebuild_tensor_v2")
    rebuild.__module__, rebuild.__qualname__ = "torch._utils", "_rebuild_tensor_v2"
    utilities._rebuild_tensor_v2 = rebuild
    storages = []

    class Writer(pickle.Pickler):
        def persistent_id(self, obj):
            if not isinstance(obj, _Storage):
                return None
            storages.append(obj.values)
            return ("storage", torch.FloatStorage, str(len(storages) - 1), "cpu", obj.values.size)

        def reducer_override(self, obj):
            if not isinstance(obj, numpy.ndarray):
                return NotImplemented
            strides = tuple(step // obj.itemsize for step in obj.strides)
            return rebuild, (_Storage(obj), 0, obj.shape, strides, False, collections.OrderedDict())

    pickled = io.BytesIO()
    with mock.patch.dict(sys.modules, {"torch": torch, "torch._utils": utilities}):
        Writer(pickled, protocol=2).dump(content)
    with zipfile.ZipFile(file, "w") as zipped:
        zipped.writestr("archive/data.pkl", pickled.getvalue())
        for number, values in enumerate(storages):
            zipped.writestr(f"archive/data/{number}", values.tobytes())
