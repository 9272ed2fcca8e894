"""A typical person detector for fisheye frames: OpenCV's `remap`, ONNX Runtime, boxes mapped to the frame, suppression.

Settings beside those of `app.py`: PLAN and CALIBRATION (files), REFINE (`nms` or `soft_nms`), CROPS (persons that are
looked at again, each upright in a view of its own) and CROP_MODEL (a file).
"""

import json
import threading
from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np
import onnxruntime
from views import Lens, View, view_of_person

SCORE = 0.3
"""The minimum score of a person. Boxes below it cannot become or change a person."""
CROP_SCORE = 0.05
"""The minimum score of a person who is looked at again."""


class Detector:
    """Finds persons in the frames of one camera."""

    def __init__(self, settings: Mapping[str, str]):
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = int(settings["THREADS"])
        models = settings["MODEL"], settings["CROP_MODEL"]
        self.sessions = [onnxruntime.InferenceSession(model, options) for model in models]
        self.size = self.sessions[0].get_inputs()[0].shape[2]
        self.crops, self.batch = int(settings["CROPS"]), int(settings["BATCH"])
        self.plan = json.loads(Path(settings["PLAN"]).read_text())["views"]
        self.calibration = json.loads(Path(settings["CALIBRATION"]).read_text())
        self.refine = {"nms": nms, "soft_nms": soft_nms}[settings["REFINE"]]
        self.views: dict[int, tuple[Lens, list[View]]] = {}
        self.making = threading.Lock()

    def detect(self, jpeg: bytes) -> list[dict]:
        """The persons in a frame."""
        frame = cv2.cvtColor(cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
        lens, views = self.views_for(frame.shape[1])
        found = self.boxes_in(self.sessions[0], frame, views, CROP_SCORE if self.crops else SCORE)
        if self.crops:
            likely = nms(found[:, :4], found[:, 4])[: self.crops]
            crops = [View(view_of_person(box, lens), self.size, lens) for box, _ in likely]
            found = np.concatenate([found, self.boxes_in(self.sessions[1], frame, crops, SCORE)])
        found = found[found[:, 4] >= SCORE]
        return [
            {"box": dict(zip(("x_min", "y_min", "x_max", "y_max"), box.tolist())), "score": score}
            for box, score in self.refine(found[:, :4], found[:, 4])
        ]

    def boxes_in(self, session, frame: np.ndarray, views: list[View], least: float) -> np.ndarray:
        """The boxes `[n, 5]` of views in the frame, with their scores."""
        rows = [np.empty((0, 5))]
        for start in range(0, len(views), self.batch):
            some = views[start : start + self.batch]
            found = session.run(["boxes", "scores"], {"images": self.tensor(frame, some)})
            for view, boxes, scores in zip(some, *found):
                good = scores >= least
                rows.append(np.column_stack([view.boxes_in_frame(boxes[good]), scores[good]]))
        rows = np.concatenate(rows)
        return rows[np.isfinite(rows).all(axis=1)]

    def tensor(self, frame: np.ndarray, views: list[View]) -> np.ndarray:
        """Some views as network input `[n, 3, size, size]`."""
        tensor = np.empty((len(views), 3, self.size, self.size), np.float32)
        for slot, view in zip(tensor, views):
            slot[:] = view.render(frame).transpose(2, 0, 1)
        return tensor

    def views_for(self, width: int) -> tuple[Lens, list[View]]:
        """The lens and the views with their maps, made at the first frame of a size."""
        with self.making:
            if width not in self.views:
                lens = Lens(self.calibration, width)
                self.views[width] = lens, [View(planned, self.size, lens) for planned in self.plan]
            return self.views[width]


def iou(box: np.ndarray, boxes: np.ndarray) -> np.ndarray:
    """The IoU of one box with many."""
    low, high = np.maximum(box[:2], boxes[:, :2]), np.minimum(box[2:], boxes[:, 2:])
    shared = np.prod(np.clip(high - low, 0, None), axis=1)
    area = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1)
    return shared / np.maximum(np.prod(box[2:] - box[:2]) + area - shared, 1e-12)


def nms(boxes: np.ndarray, scores: np.ndarray, threshold: float = 0.5) -> list[tuple[np.ndarray, float]]:
    """Selects the best boxes that do not overlap each other by `threshold`."""
    return _pick(boxes, scores, lambda overlap: (overlap < threshold).astype(float))


def soft_nms(
    boxes: np.ndarray, scores: np.ndarray, sigma: float = 0.3, floor: float = 0.3
) -> list[tuple[np.ndarray, float]]:
    """Gaussian Soft-NMS (Bodla et al., ICCV 2017); ends below the score `floor`."""
    return _pick(boxes, scores, lambda overlap: np.exp(-(overlap**2) / sigma), floor)


def _pick(boxes, scores, factor, floor: float = 0.0) -> list[tuple[np.ndarray, float]]:
    picked = []
    boxes, scores = boxes.copy(), scores.copy()
    while len(scores):
        best = int(np.argmax(scores))
        box, score = boxes[best], float(scores[best])
        picked.append((box.copy(), score))
        scores *= factor(iou(box, boxes))
        scores[best] = 0.0
        kept = scores > floor
        boxes, scores = boxes[kept], scores[kept]
    return picked
