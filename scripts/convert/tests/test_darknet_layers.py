"""Each kind of layer equals the reference."""

from ..errors import ConversionError
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

    def test_a_convolution_with_normalisation(self):
        self.require_same(convolution(7, 3), 7)

    def test_a_convolution_with_biases_alone(self):
        self.require_same(convolution(7, 3, batch_normalize=0), 7)

    def test_convolution_with_stride_padding_and_groups(self):
        self.require_same(convolution(6, 3, stride=2, pad=0, padding=2, groups=3), 6)

    def test_every_activation(self):
        for activation in ("linear", "leaky", "relu", "logistic", "mish"):
            with self.subTest(activation):
                self.require_same(convolution(6, 1, activation=activation), 6)

    def test_a_max_pooling_halves_odd_sides_upwards(self):
        self.require_same(convolution(6, 1) + section("maxpool", size=2, stride=2), 6, width=7, height=5)

    def test_max_pooling_of_stride_1_pads_right_and_below(self):
        self.require_same(convolution(6, 1) + section("maxpool", size=2, stride=1), 6)

    def test_odd_max_pooling_of_stride_1_pads_all_sides(self):
        self.require_same(convolution(6, 1) + section("maxpool", size=5, stride=1), 6)

    def test_route_joins_layers_by_absolute_and_relative_index(self):
        layers = convolution(4, 1) + convolution(5, 1) + convolution(3, 1) + section("route", layers="-2,0")
        self.require_same(layers, 9)

    def test_a_route_to_one_layer_goes_on_from_there(self):
        self.require_same(convolution(6, 1) + convolution(5, 3) + section("route", layers="-2"), 6)

    def test_a_shortcut_adds_and_activates(self):
        layers = convolution(6, 1) + convolution(6, 3) + section("shortcut", **{"from": -2}, activation="leaky")
        self.require_same(layers, 6)

    def test_an_upsampling_repeats_pixels(self):
        self.require_same(convolution(6, 1) + section("upsample", stride=2), 6)

    def test_a_reorg_follows_darknets_order_in_memory(self):
        for filters, stride, size in ((8, 2, (6, 8)), (16, 2, (4, 4)), (9, 3, (6, 9))):
            with self.subTest(filters=filters, stride=stride):
                layers = convolution(filters, 1) + section("reorg", stride=stride)
                self.require_same(layers, filters * stride**2, width=size[0], height=size[1])


class Refusals(WithDarknetFiles):
    def refused(self, cfg: str, message: str):
        with self.assertRaisesRegex(ConversionError, message):
            self.write(cfg)

    def test_an_unknown_layer_is_named_with_its_line(self):
        cfg = net() + convolution(6, 1) + section("gru", output=1)
        self.refused(cfg, r"net.cfg, line 14: \[gru\] has no translation")

    def test_an_option_that_changes_the_result_is_not_passed_over(self):
        self.refused(net() + convolution(6, 1, dilation=2) + head(6), "has the option 'dilation', which has no transl")

    def test_a_route_forwards_is_refused(self):
        self.refused(net() + section("route", layers=3) + head(6), "refers to layer 3; it is layer 0 itself")

    def test_head_with_wrong_channel_count_is_refused(self):
        self.refused(net() + convolution(7, 1) + head(6), "gets 7 channels; 1 anchors and 1 classes need 6")

    def test_a_network_without_a_head_is_refused(self):
        self.refused(net() + convolution(6, 1), "has 0 heads")

    def test_a_file_that_is_no_cfg_is_refused(self):
        self.refused("int main() { return 0; }", "is this a darknet .cfg file")

    def test_a_number_that_is_none_is_refused(self):
        self.refused(net() + convolution("many", 1), r"\[convolutional\] has filters=many; .* a whole number")

    def test_an_input_too_small_for_the_network_is_refused(self):
        self.refused(net(width=2) + convolution(6, 5, pad=0) + head(6), "a window of 5 pixels where 2 are left")
