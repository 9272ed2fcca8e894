"""Each kind of layer equals the reference."""

from .. import ConversionError
from .made_up_darknet import convolution, section
from .support import WithDarknetFiles


def net(width=6, height=8) -> str:
    return section("net", width=width, height=height, channels=3)


def head(channels: int) -> str:
    """A head with one anchor, which returns its input channels."""
    return section("region", anchors="1,1", num=1, classes=channels - 5, coords=4, softmax=1)


class Layers(WithDarknetFiles):
    def require_same(self, layers: str, channels: int, **size):
        names = self.folder / "names.txt"
        names.write_text("person\n" + "other\n" * (channels - 6), encoding="utf-8")
        self.require_same_answers(net(**size) + layers + head(channels), names)

    def test_each_layer_equals_the_reference(self):
        one = convolution(6, 1)
        shortcut = section("shortcut", **{"from": -2}, activation="leaky")
        odd = {"width": 7, "height": 5}
        for name, layers, channels, size in (
            ("a convolution with normalization", convolution(7, 3), 7, {}),
            ("a convolution with biases alone", convolution(7, 3, batch_normalize=0), 7, {}),
            ("stride, padding and groups", convolution(6, 3, stride=2, pad=0, padding=2, groups=3), 6, {}),
            ("a max pooling halves odd sides upwards", one + section("maxpool", size=2, stride=2), 6, odd),
            ("a max pooling of stride 1 pads right and below", one + section("maxpool", size=2, stride=1), 6, {}),
            ("an odd max pooling of stride 1 pads all sides", one + section("maxpool", size=5, stride=1), 6, {}),
            (
                "a route joins layers by absolute and relative index",
                *(convolution(4, 1) + convolution(5, 1) + convolution(3, 1) + section("route", layers="-2,0"), 9, {}),
            ),
            ("a route to one layer goes on from there", one + convolution(5, 3) + section("route", layers="-2"), 6, {}),
            ("a shortcut adds and activates", one + convolution(6, 3) + shortcut, 6, {}),
            ("an upsampling repeats pixels", one + section("upsample", stride=2), 6, {}),
        ):
            with self.subTest(name):
                self.require_same(layers, channels, **size)
        for activation in ("linear", "leaky", "relu", "logistic", "mish"):
            with self.subTest(activation):
                self.require_same(convolution(6, 1, activation=activation), 6)

    def test_a_reorg_follows_darknets_order_in_memory(self):
        for filters, stride, size in ((8, 2, (6, 8)), (16, 2, (4, 4)), (9, 3, (6, 9))):
            with self.subTest(filters=filters, stride=stride):
                layers = convolution(filters, 1) + section("reorg", stride=stride)
                self.require_same(layers, filters * stride**2, width=size[0], height=size[1])


class Refusals(WithDarknetFiles):
    def test_each_refusal_names_its_reason(self):
        one = convolution(6, 1)
        for cfg, message in (
            (net() + one + section("gru", output=1), r"net.cfg, line 14: \[gru\] has no translation"),
            (net() + convolution(6, 1, dilation=2) + head(6), "has the option 'dilation', which has no transl"),
            (net() + section("route", layers=3) + head(6), "refers to layer 3; it is layer 0 itself"),
            (net() + convolution(7, 1) + head(6), "gets 7 channels; 1 anchors and 1 classes need 6"),
            (net() + one, "has 0 heads"),
            ("int main() { return 0; }", "is this a darknet .cfg file"),
            (net() + convolution("many", 1), r"\[convolutional\] has filters=many; .* a whole number"),
            (net(width=2) + convolution(6, 5, pad=0) + head(6), "a window of 5 pixels where 2 are left"),
        ):
            with self.subTest(message), self.assertRaisesRegex(ConversionError, message):
                self.write(cfg)
