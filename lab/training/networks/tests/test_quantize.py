"""INT8 models: folding, rounding of weights, unchanged nodes, and the accuracy of outputs."""

import tempfile
import unittest
from pathlib import Path
from unittest import mock

import numpy
import onnx
from convert import ConversionError
from convert.onnx_builder import OnnxBuilder
from convert.tests.support import MaxPool
from onnx.reference import ReferenceEvaluator

from ..equalize import equalize
from ..folding import fold
from ..graph import OnnxGraph
from ..half import store_halves
from ..quantize import Activations, write_int8
from ..regions import int8_tensors, moved_tensors
from ..weights import quantize_weights

ROOT = Path(__file__).resolve().parents[4]
SIZE, CHANNELS = 12, 4
RANDOM_SEED = 3
NO_MEANS = numpy.zeros(16)


class MadeUpNetwork:
    """A network with NanoDet-g's operations: six convolutions, the last one decoded."""

    def __init__(self):
        self.builder = OnnxBuilder()
        self._random = numpy.random.default_rng(RANDOM_SEED)
        centered = self.builder.node("Sub", ["images", self.per_channel([120, 110, 100])])
        scaled = self.builder.node("Mul", [centered, self.per_channel([1 / 60, 1 / 55, 1 / 50])])
        first = self.leaky(self.convolution(scaled, inputs=3, pads=None))
        windows = {"kernel_shape": [3, 3], "pads": [0, 0, 0, 0], "strides": [2, 2]}
        pooled = self.builder.node("MaxPool", [self.padded(first, -numpy.inf)], **windows)
        second = self.leaky(self.convolution(self.padded(pooled, 0.0), pads=None))
        together = self.builder.node("Concat", [self.leaky(self.convolution(second)), second], axis=1)
        sides = [self.convolution(together, inputs=2 * CHANNELS), self.convolution(second)]
        summed = self.builder.node("Add", sides)
        last = self.convolution(summed, outputs=1)
        self.scores = self.builder.reshape(self.builder.node("Sigmoid", [last]), [0, -1])

    def save(self, file: Path) -> None:
        cells = (SIZE // 2 - 1) ** 2
        outputs = {"scores": (self.scores, [cells])}
        self.builder.save(file, outputs=outputs, height=SIZE, width=SIZE, description="Made up.")

    def per_channel(self, values) -> str:
        return self.builder.constant(numpy.array(values, numpy.float32).reshape(1, -1, 1, 1))

    def numbers(self, *shape: int, middle: float = 0.0) -> numpy.ndarray:
        return self._random.normal(middle, 0.3, shape).astype(numpy.float32)

    def convolution(self, tensor: str, inputs=CHANNELS, outputs=CHANNELS, pads=(1, 1, 1, 1)) -> str:
        # Channels of different sizes, which the next convolutions even out.
        sizes = numpy.geomspace(0.1, 1, outputs).astype(numpy.float32)[:, None, None, None]
        weights = self.builder.constant(self.numbers(outputs, inputs, 3, 3) * sizes)
        stated = {"pads": list(pads)} if pads else {}
        convolved = self.builder.node("Conv", [tensor, weights], kernel_shape=[3, 3], **stated)
        return self.builder.node("Add", [convolved, self.per_channel(self.numbers(outputs, middle=0.5))])

    def padded(self, tensor: str, value: float) -> str:
        pads = self.builder.constant(numpy.array([0, 0, 1, 1, 0, 0, 1, 1]))
        return self.builder.node("Pad", [tensor, pads, self.builder.constant(value)])

    def leaky(self, tensor: str) -> str:
        return self.builder.node("LeakyRelu", [tensor], alpha=0.1)


class WithNetwork(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.fp32, self.changed, self.int8 = (self.folder / f"{name}.onnx" for name in ("fp32", "changed", "int8"))
        MadeUpNetwork().save(self.fp32)
        self.graph = OnnxGraph(self.fp32)
        fold(self.graph)
        self.tensors = int8_tensors(self.graph)
        shape = (2, 3, SIZE, SIZE)
        self.images = numpy.random.default_rng(RANDOM_SEED).uniform(0, 255, shape).astype(numpy.float32)

    def answer(self, file: Path, tensors: list[str] | None = None) -> list[numpy.ndarray]:
        model = onnx.load(file)
        # The evaluator supports DequantizeLinear from this version on, with the same meaning.
        model.opset_import[0].version = 19
        model.graph.output.extend(onnx.ValueInfoProto(name=tensor) for tensor in tensors or [])
        return ReferenceEvaluator(model, new_ops=[MaxPool]).run(tensors, {"images": self.images})

    def values(self, tensors: list[str]) -> dict[str, numpy.ndarray]:
        """The values of the tensors of the graph."""
        self.graph.save(self.changed)
        return dict(zip(tensors, self.answer(self.changed, tensors), strict=True))

    def peaks(self) -> dict[str, numpy.ndarray]:
        activations = [node.output[0] for node in self.graph.nodes if node.op_type == "LeakyRelu"]
        return {name: numpy.abs(v).max(axis=(0, 2, 3)) for name, v in self.values(activations).items()}

    def equalize(self) -> dict[str, numpy.ndarray]:
        """Equalizes the graph and returns the peaks before."""
        peaks = self.peaks()
        equalize(self.graph, peaks)
        return peaks

    def measured(self) -> Activations:
        values = self.values(self.tensors)
        ends = {name: (float(v.min()), float(v.max())) for name, v in values.items()}
        return Activations(ends, {name: v.mean(axis=(0, 2, 3)) for name, v in values.items()})

    def assert_unchanged(self) -> None:
        self.graph.save(self.changed)
        [expected], [found] = self.answer(self.fp32), self.answer(self.changed)
        self.assertGreater(expected.std(), 0.01)
        numpy.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-5)


class Folding(WithNetwork):
    def test_folding_keeps_the_outputs(self):
        left = [node.op_type for node in self.graph.nodes]
        self.assertEqual(left[:4], ["Sub", "Conv", "MaxPool", "LeakyRelu"])
        self.assertEqual((left.count("Conv"), left.count("Add")), (6, 1))
        self.assertTrue({"Pad", "Mul"}.isdisjoint(left))
        self.assert_unchanged()


class Equalizing(WithNetwork):
    def test_channels_come_nearer_to_each_other_and_outputs_stay(self):
        before = self.equalize()
        self.assert_unchanged()
        for name, peaks in self.peaks().items():
            self.assertLess(peaks.max() / peaks.min(), before[name].max() / before[name].min())


class Moving(WithNetwork):
    def test_tensors_between_which_values_only_move_are_one_group(self):
        network = MadeUpNetwork()
        first = network.convolution(network.convolution("images", inputs=3))
        second = network.convolution(first)
        both = network.builder.node("Concat", [first, second], axis=1)
        all_three = network.builder.node("Concat", [both, first], axis=1)
        network.scores = network.convolution(network.convolution(all_three, inputs=3 * CHANNELS), outputs=1)
        outputs = {"scores": (network.scores, [1, SIZE, SIZE])}
        network.builder.save(self.fp32, outputs=outputs, height=SIZE, width=SIZE, description="Moves values.")
        graph = OnnxGraph(self.fp32)
        fold(graph)
        # The first group is that of the network's own Concat.
        self.assertEqual(moved_tensors(graph)[1:], [{first, second, both, all_three}])


class Weights(unittest.TestCase):
    def setUp(self):
        random = numpy.random.default_rng(RANDOM_SEED)
        self.weights = random.normal(0, 1, (64, 16, 3, 3)).astype(numpy.float32)
        self.bias = random.normal(0, 1, 64).astype(numpy.float32)

    def test_they_are_rounded_to_the_nearest_step_of_their_channel(self):
        integers, bias, scales = quantize_weights(self.weights, self.bias, 0.02, NO_MEANS)
        steps = scales[:, None, None, None]
        self.assertLessEqual(numpy.abs((integers * steps - self.weights) / steps).max(), 0.5001)
        numpy.testing.assert_allclose(bias * scales * 0.02, self.bias, atol=1e-3)

    def assert_pairs_fit_in_16_bits(self, integers: numpy.ndarray) -> None:
        pairs = integers.astype(int).transpose(0, 2, 3, 1).reshape(-1, 2)
        self.assertLessEqual(255 * numpy.maximum(pairs, 0).sum(axis=1).max(), 2**15 - 1)
        self.assertGreaterEqual(255 * numpy.minimum(pairs, 0).sum(axis=1).min(), -(2**15))

    def test_weight_pairs_do_not_saturate_16_bits(self):
        self.weights[0, :2] = 1.0
        self.weights[1, 4:6] = -1.0
        integers, _, _ = quantize_weights(self.weights, self.bias, 0.02, NO_MEANS)
        self.assert_pairs_fit_in_16_bits(integers)

    def test_pairs_of_the_committed_networks_do_not_saturate(self):
        for name in ("nanodet_g_views_416", "nanodet_g_fisheye_416", "nanodet_g_floor_416"):
            constants = OnnxGraph(ROOT / "models" / name / "model.onnx").constants.values()
            weights = [value for value in constants if value.dtype == numpy.int8 and value.ndim == 4]
            self.assertGreater(len(weights), 20)
            for value in weights:
                self.assert_pairs_fit_in_16_bits(value)

    def test_the_bias_has_what_rounding_takes_from_the_weights(self):
        means = numpy.linspace(0.5, 2, 16)
        integers, bias, scales = quantize_weights(self.weights, self.bias, 0.02, means)
        rounded = (integers * scales[:, None, None, None]).sum(axis=(2, 3)) @ means + bias * scales * 0.02
        exact = self.weights.sum(axis=(2, 3)) @ means + self.bias
        numpy.testing.assert_allclose(rounded, exact, atol=1e-3)

    def test_a_channel_without_weights_keeps_its_bias(self):
        self.weights[5], self.bias[5] = 1e-25, 2.0
        _, bias, scales = quantize_weights(self.weights, self.bias, 0.02, NO_MEANS)
        self.assertAlmostEqual(bias[5] * float(scales[5]) * 0.02, 2.0, places=5)


class Quantizing(WithNetwork):
    def test_quantization_is_accurate_and_reproducible(self):
        self.equalize()
        activations = self.measured()
        write_int8(self.graph, self.int8, activations)
        [expected], [found] = self.answer(self.fp32), self.answer(self.int8)
        numpy.testing.assert_allclose(found, expected, atol=0.03)
        self.assertFalse(numpy.array_equal(found, expected))
        written = self.int8.read_bytes()
        self.setUp()
        self.equalize()
        write_int8(self.graph, self.int8, self.measured())
        self.assertEqual(self.int8.read_bytes(), written)

    def test_first_and_last_convolutions_stay_float(self):
        write_int8(self.graph, self.int8, self.measured())
        graph = OnnxGraph(self.int8)
        convolutions = [node for node in graph.nodes if node.op_type == "Conv"]
        in_int8 = [graph.producer(node.input[1]) is not None for node in convolutions]
        self.assertEqual(in_int8, [False, True, True, True, True, False])

    def test_a_tensor_whose_range_is_missing_or_useless_is_named(self):
        for ends, reason in ({}, "was not measured"), ({self.tensors[0]: (0.0, 0.0)}, "cannot be divided"):
            with self.assertRaisesRegex(ConversionError, f"'{self.tensors[0]}'.*{reason}"):
                write_int8(self.graph, self.int8, Activations(ends, {}))


class Halves(WithNetwork):
    def setUp(self):
        super().setUp()
        self.enterContext(mock.patch("networks.half.LEAST_WEIGHTS", 100))
        self.halves = self.folder / "halves.onnx"

    def test_weights_are_stored_in_half_precision_and_read_as_floats(self):
        store_halves(self.fp32, self.halves)
        [expected], [found] = self.answer(self.fp32), self.answer(self.halves)
        numpy.testing.assert_allclose(found, expected, atol=1e-3)
        stored = [value.dtype for value in OnnxGraph(self.halves).constants.values() if value.size >= 100]
        self.assertEqual({*stored}, {numpy.dtype(numpy.float16)})

    def test_a_weight_beyond_half_precision_is_refused(self):
        graph = OnnxGraph(self.fp32)
        name = next(name for name, value in graph.constants.items() if value.size >= 100)
        graph.constants[name] = numpy.full_like(graph.constants[name], 1e6)
        graph.save(self.fp32)
        with self.assertRaisesRegex(ConversionError, "too large for half precision"):
            store_halves(self.fp32, self.halves)
