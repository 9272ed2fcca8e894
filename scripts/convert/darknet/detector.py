"""A darknet detector as a model folder for Lookdown; the outputs are the raw maps, not boxes."""

from pathlib import Path

from ..model_folder import person_class, write_model_folder
from ..onnx_builder import OnnxBuilder
from .heads import Region
from .network import Network, read_network
from .weights import read_weights


def convert_detector(cfg: Path, weights: Path, folder: Path, name: str, class_names: Path | None) -> str:
    """Writes the model folder and returns a line that describes it."""
    network = read_network(cfg)
    picture, classes = network.picture, network.heads[0].classes
    person = person_class(classes, class_names)
    builder = OnnxBuilder()
    maps = network.add_to(builder, "images", read_weights(weights, network.parameters))

    def save(file: Path) -> None:
        builder.save(
            file,
            outputs={
                f"raw_{index}": (tensor, [head.shape.channels, head.shape.height, head.shape.width])
                for index, (tensor, head) in enumerate(zip(maps, network.heads, strict=True))
            },
            height=picture.height,
            width=picture.width,
            description=f"{name}. images: RGB 0..1. raw_0 and on: what the heads of {cfg.name} get, not decoded.",
        )

    source = f"darknet {cfg.name} and {weights.name}"
    write_model_folder(folder, name=name, source=source, tables=_tables(network, person), save=save)
    return (
        f"{folder / 'model.onnx'}: {network.parameters / 1e6:.1f} million weights, "
        f"{picture.width} x {picture.height} pixels, person is class {person} of {classes}"
    )


def _tables(network: Network, person: int) -> list[str]:
    """The manifest lines of input and output."""
    anchors = network.heads[0].anchors
    lines = ["", "[input]", f"scale = {[1 / 255] * 3}", "", "[output]"]
    if isinstance(network.heads[0], Region):
        return [*lines, 'head = "yolo_v2"', f"person_class = {person}", f"anchors = {anchors}  # in cells"]
    return [
        *lines,
        'head = "yolo_v3"',
        f"person_class = {person}",
        f"anchors = {anchors}  # in pixels of the input",
        "# The anchors of raw_0, raw_1 and on. The published yolov3-tiny.cfg is wrong in its 0, 1, 2: make it 1, 2, 3.",
        f"masks = {[head.mask for head in network.heads]}",
    ]
