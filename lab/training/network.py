"""NanoDet-g as a trainable PyTorch module, read from Lookdown's own ONNX file and written back to it.

The graph's operations are replayed one by one, so that the module computes exactly what the ONNX file computes and accepts
any input whose sides are multiples of 32. `export` puts trained weights into a copy of the file.
"""

import numpy as np
import onnx
import torch
import torch.nn as nn
import torch.nn.functional as F
from onnx import numpy_helper

STRIDES = (8, 16, 32)
HEADS = ("PartitionedCall/Add_29", "PartitionedCall/Add_33", "PartitionedCall/Add_37")
BINS = 11
"""Values of the distribution of each box side, in strides."""


def _read(path):
    """The operations that the heads depend on, in order, and all constants by name."""
    graph = onnx.load(path).graph
    constants = {t.name: numpy_helper.to_array(t) for t in graph.initializer}
    for node in graph.node:
        if node.op_type == "Constant":
            constants[node.output[0]] = numpy_helper.to_array(node.attribute[0].t)
    needed, kept = set(HEADS), []
    for node in reversed(graph.node):
        if any(o in needed for o in node.output):
            kept.append(node)
            needed.update(i for i in node.input if i)
    return kept[::-1], constants


class Network(nn.Module):
    """NanoDet-g. `forward` returns the logits of each class, box-side distributions, and the point and stride of every cell."""

    def __init__(self, path):
        super().__init__()
        nodes, constants = _read(path)
        self.weights, self.onnx_names, self.steps = nn.ParameterDict(), {}, []

        def parameter(kind, name):
            key = f"{kind}{len(self.weights)}"
            self.weights[key] = nn.Parameter(torch.tensor(constants[name].copy()))
            self.onnx_names[key] = name
            return key

        for node in nodes:
            attributes = {a.name: onnx.helper.get_attribute_value(a) for a in node.attribute}
            inputs, out, kind = [i for i in node.input if i], node.output[0], node.op_type
            if kind in ("Sub", "Mul"):
                key = f"norm{len(self.steps)}"
                self.register_buffer(key, torch.tensor(constants[inputs[1]].copy()))
                self.steps.append((kind, inputs[:1], out, key))
            elif kind == "Conv":
                self.steps.append(("Conv", inputs[:1], out, (parameter("kernel", inputs[1]), attributes["strides"][0])))
            elif kind == "Add" and inputs[1] in constants:
                self.steps.append(("Bias", inputs[:1], out, parameter("bias", inputs[1])))
            elif kind == "Pad":
                p = constants[inputs[1]].tolist()
                value = float(constants[inputs[2]]) if len(inputs) > 2 else 0.0
                self.steps.append(("Pad", inputs[:1], out, ((p[3], p[7], p[2], p[6]), value)))
            elif kind == "Resize":
                self.steps.append(("Resize", inputs[:1], out, float(constants[inputs[1]][-1])))
            elif kind == "MaxPool":
                self.steps.append(
                    ("MaxPool", inputs[:1], out, (attributes["kernel_shape"][0], attributes["strides"][0]))
                )
            elif kind in ("Add", "Concat", "LeakyRelu"):
                self.steps.append((kind, inputs, out, attributes.get("alpha")))
            else:
                raise ValueError(
                    f"{path}: operation {kind} is not one of NanoDet-g's; give the file of lab/training/networks/nanodet.py"
                )
        self.steps = _fused(self.steps)
        self.last_use = {name: k for k, step in enumerate(self.steps) for name in step[1]}

    def forward(self, images):
        """`images`: n × 3 × height × width, RGB, 0 to 255."""
        values = {"images": images}
        for k, (kind, inputs, out, p) in enumerate(self.steps):
            a = values[inputs[0]]
            if kind == "Sub":
                r = a - getattr(self, p)
            elif kind == "Mul":
                r = a * getattr(self, p)
            elif kind == "ConvBias":
                kernel, bias, stride, padding = p
                r = F.conv2d(a, self.weights[kernel], self.weights[bias].reshape(-1), stride=stride, padding=padding)
            elif kind == "LeakyRelu":
                r = F.leaky_relu(a, p)
            elif kind == "Pad":
                r = F.pad(a, p[0], value=p[1])
            elif kind == "MaxPool":
                r = F.max_pool2d(a, p[0], p[1])
            elif kind == "Resize":
                r = F.interpolate(a, scale_factor=p, mode="bilinear", align_corners=False)
            elif kind == "Concat":
                r = torch.cat([values[i] for i in inputs], 1)
            else:
                r = a + values[inputs[1]]
            values[out] = r
            for name in set(inputs):
                if self.last_use[name] == k and name not in HEADS:
                    del values[name]
        logits, sides, points, strides = [], [], [], []
        for head, stride in zip(HEADS, STRIDES):
            f = values[head]
            n, channels, h, w = f.shape
            classes = channels - 4 * BINS
            logits.append(f[:, :classes].reshape(n, classes, -1))
            sides.append(f[:, classes:].reshape(n, 4, BINS, -1).permute(0, 3, 1, 2))
            ys, xs = torch.meshgrid(
                torch.arange(h, device=f.device) + 0.5, torch.arange(w, device=f.device) + 0.5, indexing="ij"
            )
            points.append(torch.stack([xs, ys], -1).reshape(-1, 2) * stride)
            strides.append(torch.full((h * w,), float(stride), device=f.device))
        return torch.cat(logits, 2), torch.cat(sides, 1), torch.cat(points), torch.cat(strides)

    def start_with(self, weights):
        """Takes the `weights`, by their names, of the same network with one class: each class starts as that one."""
        for key, name in self.onnx_names.items():
            own, value = self.weights[key], torch.tensor(weights[name].astype(np.float32))
            axis = int(value.dim() > 1 and value.shape[0] == own.shape[0])
            copies = own.shape[axis] - value.shape[axis]
            own.data = torch.cat([value.narrow(axis, 0, 1)] * copies + [value], axis) if copies else value


def _fused(steps):
    """Joins padding, convolution and bias into one step."""
    out, i = [], 0
    while i < len(steps):
        step = steps[i]
        if step[0] == "Conv" or (step[0] == "Pad" and steps[i + 1][0] == "Conv"):
            padding, source = 0, step[1]
            if step[0] == "Pad":
                sides, value = step[3]
                if len(set(sides)) != 1 or value != 0:
                    raise ValueError(
                        f"padding {sides} of {value} before a convolution; it must be equal on all sides and 0"
                    )
                padding, i = sides[0], i + 1
            (kernel, stride), bias = steps[i][3], steps[i + 1]
            out.append(("ConvBias", source, bias[2], (kernel, bias[3], stride, padding)))
            i += 2
        else:
            out.append(step)
            i += 1
    return out


def boxes_of(sides, points, strides):
    """Boxes (left, top, right, bottom) as the mean of each side's distribution."""
    bins = torch.arange(float(BINS), device=sides.device)
    d = (sides.softmax(-1) * bins).sum(-1) * strides[None, :, None]
    return torch.cat([points[None] - d[..., :2], points[None] + d[..., 2:]], -1)


def averaged(one, other, share=0.5):
    """The state `share` · one + (1 - share) · other. Tuning alone forgets; the average with COCO's weights does not."""
    return {k: share * v + (1 - share) * other[k].to(v) for k, v in one.items()}


def export(network, source, target):
    """Writes the ONNX file `source` with this network's weights to `target`."""
    model = onnx.load(source)
    by_name = {network.onnx_names[key]: p for key, p in network.weights.items()}
    found = set()
    holders = [(t.name, t) for t in model.graph.initializer]
    holders += [(n.output[0], n.attribute[0].t) for n in model.graph.node if n.op_type == "Constant"]
    for name, tensor in holders:
        if name in by_name:
            old = numpy_helper.to_array(tensor)
            new = by_name[name].detach().cpu().numpy().reshape(old.shape).astype(old.dtype)
            tensor.CopyFrom(numpy_helper.from_array(np.ascontiguousarray(new), tensor.name))
            found.add(name)
    if missing := set(by_name) - found:
        raise ValueError(
            f"{source} lacks the tensors {sorted(missing)[:3]}; export into the file that the network was read from"
        )
    onnx.save(model, target)
