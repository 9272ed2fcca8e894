"""YOLOX of any size as a model folder for Lookdown, from a PyTorch checkpoint.

Ge et al., YOLOX: Exceeding YOLO Series in 2021. How many layers there are and how wide they are, whether their
convolutions are separable, and how many classes there are, is all read off the names and shapes of the weights.
"""

from pathlib import Path

import numpy

from .errors import ConversionError
from .model_folder import person_class, write_model_folder
from .onnx_builder import OnnxBuilder
from .torch_checkpoint import read_checkpoint

STRIDES = (8, 16, 32)
VARIANCE_FLOOR = 1e-3
POOLINGS = (5, 9, 13)
TRUNK = "backbone.backbone"
PYRAMID = "backbone"


def convert_detector(checkpoint: Path, folder: Path, size: int, name: str, class_names: Path | None) -> str:
    """Writes the model folder for images of `size` x `size` pixels and returns a line that describes it."""
    if size <= 0 or size % STRIDES[-1]:
        raise ConversionError(f"The size is {size} pixels; YOLOX needs a multiple of {STRIDES[-1]}.")
    saved = read_checkpoint(checkpoint)
    weights = saved.get("model", saved) if isinstance(saved, dict) else {}
    builder = OnnxBuilder()
    try:
        classes = weights["head.cls_preds.0.weight"].shape[0]
        person = person_class(classes, class_names)
        graph = Yolox(builder, weights)
        levels = graph.pyramid(graph.trunk("images"))
        heads = [graph.head(level, index, size, person) for index, level in enumerate(levels)]
    except KeyError as missing:
        raise ConversionError(f"{checkpoint.name} has no weights {missing}; is it a checkpoint of YOLOX?") from None
    boxes, scores = zip(*heads, strict=True)

    def save(file: Path) -> None:
        builder.save_detector(
            file,
            boxes=builder.node("Concat", list(boxes), axis=1),
            scores=builder.node("Concat", list(scores), axis=1),
            size=size,
            anchors=sum((size // stride) ** 2 for stride in STRIDES),
            description=f"{name}, person class only. images: RGB 0..255. boxes: corners in pixels. scores: 0..1.",
        )

    write_model_folder(folder, name=name, source=f"YOLOX {checkpoint.name}", tables=[], save=save)
    return f"{folder / 'model.onnx'}: {size} x {size} pixels, person is class {person} of {classes}"


class Yolox:
    """Adds the parts of a YOLOX to a graph; layers are named after their weights."""

    def __init__(self, builder: OnnxBuilder, weights: dict[str, numpy.ndarray]):
        self.builder = builder
        self.weights = weights

    def trunk(self, images: str) -> list[str]:
        """CSPDarknet: feature maps of strides 8, 16 and 32 of RGB images."""
        tensor = self._unit(self._quarters(images), f"{TRUNK}.stem.conv", turn_colours=True)
        maps = []
        for stage in ("dark2", "dark3", "dark4"):
            tensor = self._block(tensor, f"{TRUNK}.{stage}.0", stride=2)
            tensor = self._partial(tensor, f"{TRUNK}.{stage}.1", shortcut=True)
            maps.append(tensor)
        tensor = self._block(tensor, f"{TRUNK}.dark5.0", stride=2)
        tensor = self._pool_pyramid(tensor, f"{TRUNK}.dark5.1")
        return [*maps[1:], self._partial(tensor, f"{TRUNK}.dark5.2", shortcut=False)]

    def pyramid(self, maps: list[str]) -> list[str]:
        """The path aggregation network, which combines coarser and finer maps."""
        fine, middle, coarse = maps
        coarse = self._block(coarse, f"{PYRAMID}.lateral_conv0")
        middle = self._partial(self._joined(self._doubled(coarse), middle), f"{PYRAMID}.C3_p4", shortcut=False)
        middle = self._block(middle, f"{PYRAMID}.reduce_conv1")
        fine = self._partial(self._joined(self._doubled(middle), fine), f"{PYRAMID}.C3_p3", shortcut=False)
        down = self._block(fine, f"{PYRAMID}.bu_conv2", stride=2)
        middle = self._partial(self._joined(down, middle), f"{PYRAMID}.C3_n3", shortcut=False)
        down = self._block(middle, f"{PYRAMID}.bu_conv1", stride=2)
        return [fine, middle, self._partial(self._joined(down, coarse), f"{PYRAMID}.C3_n4", shortcut=False)]

    def head(self, tensor: str, index: int, size: int, person: int) -> tuple[str, str]:
        """Boxes `[N, cells, 4]` in pixels and person scores `[N, cells]` of one level."""
        builder, stride = self.builder, STRIDES[index]
        tensor = self._block(tensor, f"head.stems.{index}")
        branches = []
        for branch in ("cls_convs", "reg_convs"):
            first = self._block(tensor, f"head.{branch}.{index}.0")
            branches.append(self._block(first, f"head.{branch}.{index}.1"))
        for_class, for_box = branches
        chances = [
            builder.node("Sigmoid", [self._prediction(for_class, f"head.cls_preds.{index}", [person])]),
            builder.node("Sigmoid", [self._prediction(for_box, f"head.obj_preds.{index}", [0])]),
        ]
        scores = builder.reshape(builder.node("Mul", chances), [0, -1])
        predicted = builder.reshape(self._prediction(for_box, f"head.reg_preds.{index}", [0, 1, 2, 3]), [0, 4, -1])
        offset, extent = builder.split(builder.node("Transpose", [predicted], perm=[0, 2, 1]), [2, 2], axis=2)
        rows, columns = numpy.divmod(numpy.arange((size // stride) ** 2), size // stride)
        cells = builder.constant(numpy.stack([columns, rows], axis=1).astype(numpy.float32)[None])
        middle = builder.node("Mul", [builder.node("Add", [offset, cells]), builder.constant(float(stride))])
        half = builder.node("Mul", [builder.node("Exp", [extent]), builder.constant(stride / 2)])
        corners = [builder.node("Sub", [middle, half]), builder.node("Add", [middle, half])]
        return builder.node("Concat", corners, axis=2), scores

    def _prediction(self, tensor: str, name: str, channels: list[int]) -> str:
        kernel = self.builder.constant(self.weights[f"{name}.weight"][channels].astype(numpy.float32))
        bias = self.builder.constant(self.weights[f"{name}.bias"][channels].astype(numpy.float32))
        return self.builder.node("Conv", [tensor, kernel, bias], kernel_shape=[1, 1])

    def _block(self, tensor: str, name: str, stride: int = 1) -> str:
        """A convolution, or the two of a separable one."""
        if f"{name}.dconv.conv.weight" in self.weights:
            return self._unit(self._unit(tensor, f"{name}.dconv", stride, separable=True), f"{name}.pconv")
        return self._unit(tensor, name, stride)

    def _unit(
        self, tensor: str, name: str, stride: int = 1, *, separable: bool = False, turn_colours: bool = False
    ) -> str:
        """A convolution with its normalization multiplied in, and SiLU."""
        kernel = self.weights[f"{name}.conv.weight"].astype(numpy.float64)
        if turn_colours:
            # YOLOX was trained on blue, green, red; the stem gets four quarters of an image with three colors each.
            kernel = kernel.reshape(kernel.shape[0], 4, 3, *kernel.shape[2:])[:, :, ::-1].reshape(kernel.shape)
        scale, shift, mean, variance = (
            self.weights[f"{name}.bn.{part}"].astype(numpy.float64)
            for part in ("weight", "bias", "running_mean", "running_var")
        )
        factors = scale / numpy.sqrt(variance + VARIANCE_FLOOR)
        inputs = [
            tensor,
            self.builder.constant((kernel * factors[:, None, None, None]).astype(numpy.float32)),
            self.builder.constant((shift - mean * factors).astype(numpy.float32)),
        ]
        extent = kernel.shape[2]
        convolved = self.builder.node(
            "Conv",
            inputs,
            kernel_shape=[extent, extent],
            strides=[stride, stride],
            pads=[extent // 2] * 4,
            group=kernel.shape[0] if separable else 1,
        )
        return self.builder.node("Mul", [convolved, self.builder.node("Sigmoid", [convolved])])

    def _partial(self, tensor: str, name: str, *, shortcut: bool) -> str:
        """A cross stage partial layer: half of the channels pass through bottlenecks."""
        through, beside = self._block(tensor, f"{name}.conv1"), self._block(tensor, f"{name}.conv2")
        index = 0
        while f"{name}.m.{index}.conv1.conv.weight" in self.weights:
            narrowed = self._block(through, f"{name}.m.{index}.conv1")
            widened = self._block(narrowed, f"{name}.m.{index}.conv2")
            through = self.builder.node("Add", [through, widened]) if shortcut else widened
            index += 1
        return self._block(self._joined(through, beside), f"{name}.conv3")

    def _pool_pyramid(self, tensor: str, name: str) -> str:
        """Spatial pyramid pooling."""
        narrowed = self._block(tensor, f"{name}.conv1")
        pooled = [
            self.builder.node("MaxPool", [narrowed], kernel_shape=[k, k], strides=[1, 1], pads=[k // 2] * 4)
            for k in POOLINGS
        ]
        return self._block(self._joined(narrowed, *pooled), f"{name}.conv2")

    def _quarters(self, images: str) -> str:
        """Every second pixel of every second row, for the four offsets in order."""

        def quarter(row: int, column: int) -> str:
            begins, ends, axes, steps = ([row, column], [2**31, 2**31], [2, 3], [2, 2])
            parts = (self.builder.constant(numpy.array(part, numpy.int64)) for part in (begins, ends, axes, steps))
            return self.builder.node("Slice", [images, *parts])

        return self._joined(quarter(0, 0), quarter(1, 0), quarter(0, 1), quarter(1, 1))

    def _joined(self, *tensors: str) -> str:
        return self.builder.node("Concat", list(tensors), axis=1)

    def _doubled(self, tensor: str) -> str:
        factors = self.builder.constant(numpy.array([1, 1, 2, 2], numpy.float32))
        how = {"mode": "nearest", "coordinate_transformation_mode": "asymmetric", "nearest_mode": "floor"}
        return self.builder.node("Resize", [tensor, "", factors], **how)
