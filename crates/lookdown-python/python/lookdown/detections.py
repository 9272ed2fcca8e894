"""The persons in one frame, as arrays."""

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from lookdown.figure import Source, figure

if TYPE_CHECKING:
    import pandas
    import shapely
    import supervision

Floats = npt.NDArray[np.float64]


class Detections:
    """N persons, highest score first. Pixels are corner-origin: pixel `i` covers `[i, i + 1)`."""

    boxes: Floats
    """(N, 4): x_min, y_min, x_max, y_max, pixels."""
    oriented_boxes: Floats
    """(N, 5): center x, center y, width, height in pixels, and the clockwise angle in degrees."""
    scores: Floats
    """(N,): 0 to 1; with fusion, the probability that it is a person."""
    bearings: Floats
    """(N, 2): azimuth and angle from the optical axis, degrees. NaN if unknown."""
    floor: Floats
    """(N, 2): position on the floor, meters. NaN without the height of the camera."""
    report: dict[str, Any]
    """The whole report, as the server sends it."""

    def __init__(self, report: dict[str, Any], image: Source | None = None) -> None:
        """Takes a report of the server, and the frame for figures in notebooks."""
        persons = report["persons"]
        self._image = image
        self.report = report
        self.boxes = _array(persons, "box", ("x_min", "y_min", "x_max", "y_max"))
        self.oriented_boxes = _array(persons, "oriented_box", ("cx", "cy", "width", "height", "angle_deg"))
        self.scores = np.array([person["score"] for person in persons], dtype=np.float64)
        self.bearings = _array(persons, "bearing", ("azimuth_deg", "off_axis_deg"))
        self.floor = _array(persons, "floor", ("x_m", "y_m"))

    @classmethod
    def from_json(cls, report: str | bytes, image: Source | None = None) -> "Detections":
        """Reads a report as the server sends it."""
        return cls(json.loads(report), image)

    def __len__(self) -> int:
        """Returns the number of persons."""
        return len(self.scores)

    def __repr__(self) -> str:
        """Returns the number of persons and the size of the frame."""
        image = self.report["image"]
        return f"Detections({len(self)} persons, frame {image['width']}×{image['height']})"

    def _repr_html_(self) -> str | None:
        """Returns the frame with the persons, which a notebook shows."""
        return None if self._image is None else figure(self._image, self.report, self.corners())

    @property
    def zones(self) -> list[list[str]]:
        """The names of the zones in which each person stands."""
        return [person.get("zones", []) for person in self.report["persons"]]

    @property
    def warnings(self) -> list[dict[str, str]]:
        """Circumstances to consider: `code` and `message`."""
        return list(self.report["warnings"])

    def to_coco(self, image_id: int = 1) -> list[dict[str, Any]]:
        """Returns results in the COCO format, category 1."""
        return [
            {
                "image_id": image_id,
                "category_id": 1,
                "bbox": [x_min, y_min, x_max - x_min, y_max - y_min],
                "score": score,
            }
            for (x_min, y_min, x_max, y_max), score in zip(self.boxes.tolist(), self.scores.tolist(), strict=True)
        ]

    def to_supervision(self) -> "supervision.Detections":
        """Converts to `supervision.Detections`, with oriented boxes as corners."""
        import supervision

        count = len(self)
        return supervision.Detections(
            xyxy=self.boxes.astype(np.float32),
            confidence=self.scores.astype(np.float32),
            class_id=np.zeros(count, dtype=int),
            data={"xyxyxyxy": self.corners().astype(np.float32), "class_name": np.array(["person"] * count)},
        )

    def to_pandas(self) -> "pandas.DataFrame":
        """Converts to a table with a row per person."""
        import pandas

        columns = [
            (("score",), self.scores[:, None]),
            (("x_min", "y_min", "x_max", "y_max"), self.boxes),
            (("cx", "cy", "width", "height", "angle_deg"), self.oriented_boxes),
            (("azimuth_deg", "off_axis_deg"), self.bearings),
            (("x_m", "y_m"), self.floor),
        ]
        table = {name: values[:, index] for names, values in columns for index, name in enumerate(names)}
        return pandas.DataFrame({**table, "zones": self.zones})

    def to_shapely(self) -> "list[shapely.Polygon]":
        """Converts the oriented boxes to polygons in pixels."""
        import shapely

        return [shapely.Polygon(corners) for corners in self.corners()]

    def to_geojson(self) -> dict[str, Any]:
        """Returns the oriented boxes as GeoJSON polygons in pixels, as `format=geojson` of the server has them."""
        features = [
            {
                "type": "Feature",
                "geometry": {"type": "Polygon", "coordinates": [[*corners, corners[0]]]},
                "properties": {"score": score},
            }
            for corners, score in zip(self.corners().tolist(), self.scores.tolist(), strict=True)
        ]
        return {"type": "FeatureCollection", "features": features}

    def corners(self) -> Floats:
        """Returns the corners of the oriented boxes, (N, 4, 2) pixels, clockwise from the top left."""
        center, size = self.oriented_boxes[:, None, :2], self.oriented_boxes[:, None, 2:4]
        angle = np.radians(self.oriented_boxes[:, 4])
        signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        offsets = signs[None] * size / 2.0
        cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
        x, y = offsets[..., 0], offsets[..., 1]
        turned: Floats = np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)
        return center + turned


def _array(persons: list[dict[str, Any]], name: str, fields: tuple[str, ...]) -> Floats:
    """Returns the fields of one object of each person, NaN where a person has no such object."""
    rows = [[(person.get(name) or {}).get(field, np.nan) for field in fields] for person in persons]
    return np.array(rows, dtype=np.float64).reshape(len(persons), len(fields))
