"""A darknet detector as a model folder for Lookdown: YOLOv2 as its raw map, YOLOv3 with decoded boxes."""

from pathlib import Path

from ..model_folder import person_class, write_model_folder
from ..onnx_builder import OnnxBuilder
from .heads import Region
from .network import Network, read_network
from .weights import read_weights
from .yolo_boxes import decoded


def convert_detector(cfg: Path, weights: Path, folder: Path, name: str, class_names: Path | None) -> str:
    """Writes the model folder and returns a line that describes it."""
    network = read_network(cfg)
    shape, classes = network.input_shape, network.heads[0].classes
    person = person_class(classes, class_names)
    builder = OnnxBuilder()
    maps = network.add_to(builder, "images", read_weights(weights, network.parameters))

    outputs = _outputs(builder, network, maps, person)

    def save(file: Path) -> None:
        builder.save(
            file,
            outputs=outputs,
            height=shape.height,
            width=shape.width,
            description=f"{name}, from {cfg.name}. images: RGB 0..1. Outputs: {', '.join(outputs)}.",
        )

    source = f"darknet {cfg.name} and {weights.name}"
    write_model_folder(folder, name=name, source=source, tables=_tables(network, person), save=save)
    return (
        f"{folder / 'model.onnx'}: {network.parameters / 1e6:.1f} million weights, "
        f"{shape.width} x {shape.height} pixels, person is class {person} of {classes}"
    )


def _outputs(builder: OnnxBuilder, network: Network, maps: list[str], person: int) -> dict:
    """The outputs of the graph and their shapes: the raw map of YOLOv2, or the boxes and scores of YOLOv3."""
    head = network.heads[0]
    if isinstance(head, Region):
        return {"raw": (maps[0], [head.shape.channels, head.shape.height, head.shape.width])}
    boxes, scores, candidates = decoded(builder, network, maps, person)
    return {"boxes": (boxes, [candidates, 4]), "scores": (scores, [candidates])}


def _tables(network: Network, person: int) -> list[str]:
    """The manifest lines of input and output."""
    lines = ["", "[input]", f"scale = {[1 / 255] * 3}"]
    if not isinstance(network.heads[0], Region):
        return lines
    anchors = network.heads[0].anchors
    return [*lines, "", "[output]", 'head = "yolo_v2"', f"person_class = {person}", f"anchors = {anchors}  # in cells"]
