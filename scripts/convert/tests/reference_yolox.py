"""A reference implementation of YOLOX in float64, from the paper and its published weights."""

import numpy

from .reference import correlated


def run(weights: dict[str, numpy.ndarray], rgb: numpy.ndarray) -> tuple[numpy.ndarray, numpy.ndarray]:
    """Corners `[cells, 4]` and probabilities `[cells, classes]` for an RGB image `[3, size, size]`."""
    image = rgb[::-1].astype(numpy.float64)
    quarters = [image[:, row::2, column::2] for row, column in ((0, 0), (1, 0), (0, 1), (1, 1))]
    image = unit(weights, "backbone.backbone.stem.conv", numpy.concatenate(quarters))
    maps = []
    for stage in ("dark2", "dark3", "dark4"):
        image = block(weights, f"backbone.backbone.{stage}.0", image, 2)
        image = partial(weights, f"backbone.backbone.{stage}.1", image, add=True)
        maps.append(image)
    image = block(weights, "backbone.backbone.dark5.0", image, 2)
    image = block(weights, "backbone.backbone.dark5.1.conv1", image)
    image = numpy.concatenate([image, *(highest(image, size) for size in (5, 9, 13))])
    image = block(weights, "backbone.backbone.dark5.1.conv2", image)
    coarse = partial(weights, "backbone.backbone.dark5.2", image, add=False)
    _, fine, middle = maps

    lateral = block(weights, "backbone.lateral_conv0", coarse)
    first = partial(weights, "backbone.C3_p4", numpy.concatenate([doubled(lateral), middle]), add=False)
    reduced = block(weights, "backbone.reduce_conv1", first)
    outputs = [partial(weights, "backbone.C3_p3", numpy.concatenate([doubled(reduced), fine]), add=False)]
    for down, joined, name in (("bu_conv2", reduced, "C3_n3"), ("bu_conv1", lateral, "C3_n4")):
        halved = block(weights, f"backbone.{down}", outputs[-1], 2)
        outputs.append(partial(weights, f"backbone.{name}", numpy.concatenate([halved, joined]), add=False))

    answers = [level(weights, index, image, 8 << index) for index, image in enumerate(outputs)]
    return tuple(numpy.concatenate(parts) for parts in zip(*answers, strict=True))


def level(weights, index, image, stride):
    """Corners and probabilities of the cells of one map, row by row."""
    image = block(weights, f"head.stems.{index}", image)
    features = {}
    for branch in ("cls", "reg"):
        first = block(weights, f"head.{branch}_convs.{index}.0", image)
        features[branch] = block(weights, f"head.{branch}_convs.{index}.1", first)
    raw = {}
    for kind, branch in (("cls", "cls"), ("obj", "reg"), ("reg", "reg")):
        kernel, bias = (weights[f"head.{kind}_preds.{index}.{part}"] for part in ("weight", "bias"))
        raw[kind] = correlated(features[branch], kernel, 1, 0) + bias[:, None, None]
    corners, chances = [], []
    for row in range(image.shape[1]):
        for column in range(image.shape[2]):
            x, y, width, height = raw["reg"][:, row, column]
            x, y = (x + column) * stride, (y + row) * stride
            width, height = numpy.exp(width) * stride, numpy.exp(height) * stride
            corners.append([x - width / 2, y - height / 2, x + width / 2, y + height / 2])
            chances.append(sigmoid(raw["cls"][:, row, column]) * sigmoid(raw["obj"][0, row, column]))
    return numpy.array(corners), numpy.array(chances)


def block(weights, name, image, stride=1):
    """A convolution, or a separable one."""
    if f"{name}.pconv.conv.weight" in weights:
        return unit(weights, f"{name}.pconv", unit(weights, f"{name}.dconv", image, stride, image.shape[0]))
    return unit(weights, name, image, stride)


def unit(weights, name, image, stride=1, groups=1):
    """A convolution, its normalization, and x times the sigmoid of x."""
    kernel = weights[f"{name}.conv.weight"]
    result = correlated(image, kernel, stride, kernel.shape[2] // 2, groups)
    own = {
        part: weights[f"{name}.bn.{part}"].astype(float)[:, None, None]
        for part in ("weight", "bias", "running_mean", "running_var")
    }
    result = (result - own["running_mean"]) / numpy.sqrt(own["running_var"] + 0.001) * own["weight"] + own["bias"]
    return result * sigmoid(result)


def partial(weights, name, image, add):
    """A cross stage partial layer: half of the channels pass through bottlenecks."""
    through, past = block(weights, f"{name}.conv1", image), block(weights, f"{name}.conv2", image)
    index = 0
    while any(key.startswith(f"{name}.m.{index}.") for key in weights):
        result = block(weights, f"{name}.m.{index}.conv2", block(weights, f"{name}.m.{index}.conv1", through))
        through = through + result if add else result
        index += 1
    return block(weights, f"{name}.conv3", numpy.concatenate([through, past]))


def highest(image, size):
    """The largest value around every position."""
    around = size // 2
    result = numpy.empty_like(image)
    for row in range(image.shape[1]):
        for column in range(image.shape[2]):
            window = image[:, max(row - around, 0) : row + around + 1, max(column - around, 0) : column + around + 1]
            result[:, row, column] = window.max(axis=(1, 2))
    return result


def doubled(image):
    """Every pixel four times."""
    return image.repeat(2, axis=1).repeat(2, axis=2)


def sigmoid(values):
    """1 / (1 + e^-x)."""
    return 1 / (1 + numpy.exp(-values))
