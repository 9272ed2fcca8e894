"""Reference implementations of layers, pixel by pixel in float64, to check the graphs of the converters.

It shares no code with the converters and follows what darknet and YOLOX compute, not what ONNX offers.
"""

import numpy


def parse(cfg: str) -> list[tuple[str, dict[str, str]]]:
    """Kinds and options of the sections."""
    sections = []
    for line in filter(None, map(str.strip, cfg.splitlines())):
        if line.startswith("["):
            sections.append((line.strip("[]"), {}))
        else:
            name, _, value = line.partition("=")
            sections[-1][1][name] = value
    return sections


def run(cfg: str, numbers: numpy.ndarray, image: numpy.ndarray) -> list[numpy.ndarray]:
    """The inputs of the heads, each `[channels, height, width]`, for an image `[3, height, width]`."""
    maps, heads, numbers = [], [], numbers.astype(numpy.float64)
    last = image.astype(numpy.float64)
    for kind, options in parse(cfg)[1:]:
        whole = {name: int(value) for name, value in options.items() if value.lstrip("-").isdigit()}
        match kind:
            case "convolutional":
                last, numbers = convolved(last, options, whole, numbers)
            case "maxpool":
                size, stride = whole["size"], whole["stride"]
                last = pooled(last, size, stride, whole.get("padding", size - 1))
            case "route":
                wanted = [int(part) for part in options["layers"].split(",")]
                last = numpy.concatenate([maps[number if number >= 0 else len(maps) + number] for number in wanted])
            case "shortcut":
                last = activated(last + maps[len(maps) + whole["from"]], options.get("activation", "linear"))
            case "upsample":
                rows, columns = (numpy.arange(extent * whole["stride"]) // whole["stride"] for extent in last.shape[1:])
                last = last[:, rows][:, :, columns]
            case "reorg":
                last = reordered(last, whole["stride"])
            case "region" | "yolo":
                heads.append(last)
        maps.append(last)
    assert not numbers.size, "the network left weights over"
    return heads


def yolov3_boxes(cfg: str, maps: list[numpy.ndarray], person: int = 0) -> tuple[numpy.ndarray, numpy.ndarray]:
    """Corners `[A, 4]` in pixels and scores `[A]` of the raw maps, box by box."""
    _, net = parse(cfg)[0]
    heads = [options for kind, options in parse(cfg) if kind == "yolo"]
    boxes, scores = [], []
    for values, options in zip(maps, heads, strict=True):
        classes, numbers = int(options["classes"]), [float(part) for part in options["anchors"].split(",")]
        _, rows, columns = values.shape
        stride = int(net["width"]) / columns
        for place, anchor in enumerate(int(part) for part in options["mask"].split(",")):
            for row in range(rows):
                for column in range(columns):
                    first = place * (5 + classes)
                    t_x, t_y, t_w, t_h, t_o, *logits = values[first : first + 5 + classes, row, column]
                    x, y = (column + logistic(t_x)) * stride, (row + logistic(t_y)) * stride
                    w, h = numbers[2 * anchor] * numpy.exp(t_w), numbers[2 * anchor + 1] * numpy.exp(t_h)
                    boxes.append([x - w / 2, y - h / 2, x + w / 2, y + h / 2])
                    scores.append(logistic(t_o) * logistic(logits[person]))
    return numpy.array(boxes), numpy.array(scores)


def logistic(value: float) -> float:
    """1 / (1 + e^-value)."""
    return 1 / (1 + numpy.exp(-value))


def convolved(image, options, whole, numbers):
    """A convolution, and the remaining weights."""
    filters, size, stride = whole["filters"], whole["size"], whole["stride"]
    groups = whole.get("groups", 1)
    channels = image.shape[0] // groups
    bias, numbers = numpy.split(numbers, [filters])
    if whole.get("batch_normalize"):
        scales, means, variances, numbers = numpy.split(numbers, [filters, 2 * filters, 3 * filters])
    kernel, numbers = numpy.split(numbers, [filters * channels * size * size])
    padding = size // 2 if whole.get("pad") else whole.get("padding", 0)
    result = correlated(image, kernel.reshape(filters, channels, size, size), stride, padding, groups)
    if whole.get("batch_normalize"):
        for index in range(filters):
            result[index] = (result[index] - means[index]) / numpy.sqrt(variances[index] + 1e-6) * scales[index]
    return activated(result + bias[:, None, None], options["activation"]), numbers


def correlated(image, kernel, stride, padding, groups=1):
    """The sum of kernel times window at every position."""
    filters, channels, size, _ = kernel.shape
    padded = numpy.pad(image, ((0, 0), (padding, padding), (padding, padding)))
    height, width = ((extent + 2 * padding - size) // stride + 1 for extent in image.shape[1:])
    result = numpy.empty((filters, height, width))
    per_group, rows_of_kernel = filters // groups, kernel.reshape(filters, -1)
    for row in range(height):
        for column in range(width):
            patch = padded[:, row * stride : row * stride + size, column * stride : column * stride + size]
            for group in range(groups):
                own = slice(group * per_group, (group + 1) * per_group)
                seen = patch[group * channels : (group + 1) * channels].ravel()
                result[own, row, column] = rows_of_kernel[own] @ seen
    return result


def activated(values, activation):
    """The activation of every value."""
    match activation:
        case "linear":
            return values
        case "leaky":
            return numpy.where(values > 0, values, 0.1 * values)
        case "relu":
            return numpy.where(values > 0, values, 0)
        case "logistic":
            return 1 / (1 + numpy.exp(-values))
        case "mish":
            return values * numpy.tanh(numpy.log(1 + numpy.exp(values)))


def pooled(image, size, stride, padding):
    """The largest value of each window; positions outside the image do not count."""
    channels, height, width = image.shape
    rows, columns = ((extent + padding - size) // stride + 1 for extent in (height, width))
    result = numpy.full((channels, rows, columns), -numpy.inf)
    for row in range(rows):
        for column in range(columns):
            top, left = row * stride - padding // 2, column * stride - padding // 2
            window = image[:, max(top, 0) : top + size, max(left, 0) : left + size]
            result[:, row, column] = window.max(axis=(1, 2))
    return result


def reordered(image, stride):
    """Reads the memory in order: the map is read as one with fewer channels and larger sides."""
    channels, height, width = image.shape
    memory, result = image.ravel(), numpy.empty(image.size)
    coarse = channels // stride**2
    for place in range(image.size):
        channel, inside = divmod(place, height * width)
        row, column = divmod(inside, width)
        shift, source_channel = divmod(channel, coarse)
        source_row = row * stride + shift // stride
        source_column = column * stride + shift % stride
        result[place] = memory[(source_channel * height * stride + source_row) * width * stride + source_column]
    return result.reshape(channels * stride**2, height // stride, width // stride)
