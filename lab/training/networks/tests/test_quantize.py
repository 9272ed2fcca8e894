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

from ..folding import fold
from ..graph import OnnxGraph
from ..half import store_halves
from ..quantize import ActivationRanges, write_int8
from ..regions import FLOAT_CONVOLUTIONS, int8_tensors, moved_tensors
from ..weights import quantize_weights

ROOT = Path(__file__).resolve().parents[4]
SIZE, CHANNELS = 12, 4
RANDOM_SEED = 3


class MadeUpNetwork:
    """A network with the nodes that converters write around convolutions: six of them, the last one decoded."""

    def __init__(self):
        self.builder = OnnxBuilder()
        self._random = numpy.random.default_rng(RANDOM_SEED)
        scaled = self.builder.node("Mul", ["images", self.builder.constant(2 / 255)])
        first = self.relu6(self.shifted(self.multiplied(self.convolution(scaled, inputs=3))))
        second = self.convolution(self.padded(self.leaky(self.normalised(first)), 0.0), pads=None)
        windows = {"kernel_shape": [3, 3], "pads": [0, 0, 0, 0], "strides": [2, 2]}
        pooled = self.builder.node("MaxPool", [self.padded(second, -numpy.inf)], **windows)
        third = self.relu6(self.shifted(self.convolution(pooled)))
        summed = self.builder.node("Add", [self.convolution(third), third])
        last = self.convolution(self.leaky(self.shifted(summed)), outputs=1)
        self.scores = self.builder.reshape(self.builder.node("Sigmoid", [last]), [0, -1])

    def save(self, file: Path) -> None:
        cells = (SIZE // 2) ** 2
        outputs = {"scores": (self.scores, [cells])}
        self.builder.save(file, outputs=outputs, height=SIZE, width=SIZE, description="Made up.")

    def numbers(self, *shape: int, middle: float = 0.0) -> str:
        return self.builder.constant(self._random.normal(middle, 0.3, shape).astype(numpy.float32))

    def convolution(self, tensor: str, inputs=CHANNELS, outputs=CHANNELS, pads=(1, 1, 1, 1)) -> str:
        weights = self.numbers(outputs, inputs, 3, 3)
        stated = {"pads": list(pads)} if pads else {}
        return self.builder.node("Conv", [tensor, weights], kernel_shape=[3, 3], **stated)

    def multiplied(self, tensor: str) -> str:
        return self.builder.node("Mul", [tensor, self.numbers(1, CHANNELS, 1, 1, middle=1)])

    def shifted(self, tensor: str) -> str:
        return self.builder.node("Add", [self.numbers(1, CHANNELS, 1, 1, middle=0.5), tensor])

    def normalised(self, tensor: str) -> str:
        convolved = self.convolution(tensor)
        parameters = [self.numbers(CHANNELS, middle=middle) for middle in (1, 0, 0)]
        variance = self.builder.constant(self._random.uniform(0.5, 2, CHANNELS).astype(numpy.float32))
        return self.builder.node("BatchNormalization", [convolved, *parameters, variance], epsilon=0.01)

    def padded(self, tensor: str, value: float) -> str:
        pads = self.builder.constant(numpy.array([0, 0, 1, 1, 0, 0, 1, 1]))
        return self.builder.node("Pad", [tensor, pads, self.builder.constant(value)])

    def relu6(self, tensor: str) -> str:
        return self.builder.node("Clip", [tensor, self.builder.constant(0.0), self.builder.constant(6.0)])

    def leaky(self, tensor: str) -> str:
        return self.builder.node("LeakyRelu", [tensor], alpha=0.1)


class WithNetwork(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.fp32, self.folded, self.int8 = (self.folder / f"{name}.onnx" for name in ("fp32", "folded", "int8"))
        MadeUpNetwork().save(self.fp32)
        graph = OnnxGraph(self.fp32)
        fold(graph)
        self.tensors = int8_tensors(graph)
        graph.save(self.folded)
        shape = (2, 3, SIZE, SIZE)
        self.images = numpy.random.default_rng(RANDOM_SEED).uniform(0, 255, shape).astype(numpy.float32)

    def answer(self, file: Path, tensors: list[str] | None = None) -> list[numpy.ndarray]:
        model = onnx.load(file)
        # The evaluator supports DequantizeLinear from this version on, with the same meaning.
        model.opset_import[0].version = 19
        model.graph.output.extend(onnx.ValueInfoProto(name=tensor) for tensor in tensors or [])
        return ReferenceEvaluator(model, new_ops=[MaxPool]).run(tensors, {"images": self.images})

    def measured(self) -> ActivationRanges:
        values = self.answer(self.folded, self.tensors)
        ends = {name: (float(v.min()), float(v.max())) for name, v in zip(self.tensors, values, strict=True)}
        return ActivationRanges(ends)


class Folding(WithNetwork):
    def test_folding_keeps_the_outputs(self):
        left = [node.op_type for node in onnx.load(self.folded).graph.node]
        self.assertEqual(left.count("Conv"), 6)
        self.assertEqual(left.count("Add"), 1)
        self.assertTrue({"Pad", "BatchNormalization"}.isdisjoint(left))
        self.assertEqual(left.count("Mul"), 1)
        [expected], [found] = self.answer(self.fp32), self.answer(self.folded)
        self.assertGreater(expected.std(), 0.01)
        numpy.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-5)


class Moving(WithNetwork):
    def test_tensors_between_which_values_only_move_are_one_group(self):
        network = MadeUpNetwork()
        builder, tensor = network.builder, network.convolution("images", inputs=3)
        for _ in range(FLOAT_CONVOLUTIONS):
            tensor = network.convolution(tensor)
        pooled = builder.node("MaxPool", [tensor], kernel_shape=[3, 3], pads=[1] * 4, strides=[1, 1])
        beside = network.relu6(network.convolution(pooled))
        together = builder.node("Concat", [pooled, beside], axis=1)
        scores = builder.reshape(network.convolution(network.convolution(together, inputs=2 * CHANNELS)), [0, -1])
        outputs = {"scores": (scores, [SIZE * SIZE * CHANNELS])}
        builder.save(self.fp32, outputs=outputs, height=SIZE, width=SIZE, description="Moves values.")
        graph = OnnxGraph(self.fp32)
        fold(graph)
        self.assertEqual(moved_tensors(graph), [{tensor, pooled, beside, together}])


class Weights(unittest.TestCase):
    def setUp(self):
        random = numpy.random.default_rng(RANDOM_SEED)
        self.weights = random.normal(0, 1, (64, 16, 3, 3)).astype(numpy.float32)
        self.bias = random.normal(0, 1, 64).astype(numpy.float32)

    def test_they_are_rounded_to_the_nearest_step_of_their_channel(self):
        integers, bias, scales = quantize_weights(self.weights, self.bias, 0.02)
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
        integers, _, _ = quantize_weights(self.weights, self.bias, 0.02)
        self.assert_pairs_fit_in_16_bits(integers)

    def test_pairs_of_the_committed_networks_do_not_saturate(self):
        for name in ("nanodet_g_views_416", "nanodet_g_fisheye_416", "nanodet_g_floor_416"):
            constants = OnnxGraph(ROOT / "models" / name / "model.onnx").constants.values()
            weights = [value for value in constants if value.dtype == numpy.int8 and value.ndim == 4]
            self.assertGreater(len(weights), 20)
            for value in weights:
                # Depthwise convolutions have no neighboring inputs.
                if value.shape[1] > 1:
                    self.assert_pairs_fit_in_16_bits(value)

    def test_depthwise_weights_use_all_of_the_8_bits(self):
        integers, _, _ = quantize_weights(self.weights[:, :1], self.bias, 0.02)
        self.assertEqual(numpy.abs(integers).reshape(64, -1).max(axis=1).tolist(), [127] * 64)

    def test_a_channel_without_weights_keeps_its_bias(self):
        self.weights[5], self.bias[5] = 1e-25, 2.0
        _, bias, scales = quantize_weights(self.weights, self.bias, 0.02)
        self.assertAlmostEqual(bias[5] * float(scales[5]) * 0.02, 2.0, places=5)


class Quantizing(WithNetwork):
    def test_quantization_is_accurate_and_reproducible(self):
        write_int8(self.fp32, self.int8, self.measured())
        written = self.int8.read_bytes()
        [expected], [found] = self.answer(self.fp32), self.answer(self.int8)
        numpy.testing.assert_allclose(found, expected, atol=0.03)
        self.assertFalse(numpy.array_equal(found, expected))
        write_int8(self.fp32, self.int8, self.measured())
        self.assertEqual(self.int8.read_bytes(), written)

    def test_first_three_and_last_convolutions_stay_float(self):
        write_int8(self.fp32, self.int8, self.measured())
        graph = OnnxGraph(self.int8)
        convolutions = [node for node in graph.nodes if node.op_type == "Conv"]
        in_int8 = [graph.producer(node.input[1]) is not None for node in convolutions]
        self.assertEqual(in_int8, [False, False, False, True, True, False])

    def test_a_tensor_whose_range_is_missing_or_useless_is_named(self):
        for ends, reason in ({}, "was not measured"), ({self.tensors[0]: (0.0, 0.0)}, "cannot be divided"):
            with self.assertRaisesRegex(ConversionError, f"'{self.tensors[0]}'.*{reason}"):
                write_int8(self.fp32, self.int8, ActivationRanges(ends))


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
