"""A typical person detector for fisheye frames: OpenCV's `remap`, ONNX Runtime, boxes mapped to the frame, suppression.

Settings beside those of `app.py`: PLAN and CALIBRATION (files), REFINE (`nms` or `soft_nms`).
"""

import json
import threading
from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np
import onnxruntime
from views import Lens, View

SCORE = 0.3
"""The minimum score of a person. Boxes below it cannot become or change a person."""


def detector_of(settings: Mapping[str, str]) -> "Detector":
    """The detector of these settings."""
    return Detector(
        settings["MODEL"],
        json.loads(Path(settings["PLAN"]).read_text()),
        json.loads(Path(settings["CALIBRATION"]).read_text()),
        settings["REFINE"],
        int(settings["THREADS"]),
        int(settings["BATCH"]),
    )


class Detector:
    """Finds persons in the frames of one camera."""

    def __init__(self, model: str, plan: dict, calibration: dict, refine: str, threads: int, batch: int):
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = threads
        self.session = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
        self.size = self.session.get_inputs()[0].shape[2]
        self.plan, self.calibration, self.batch = plan["views"], calibration, batch
        self.refine = {"nms": nms, "soft_nms": soft_nms}[refine]
        self.views: dict[int, list[View]] = {}
        self.making = threading.Lock()

    def detect(self, jpeg: bytes) -> list[dict]:
        """The persons in a frame."""
        frame = cv2.cvtColor(cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
        views = self.views_for(frame.shape[1])
        boxes, scores = [], []
        for start in range(0, len(views), self.batch):
            some = views[start : start + self.batch]
            found = self.session.run(["boxes", "scores"], {"images": self.tensor(frame, some)})
            for view, view_boxes, view_scores in zip(some, *found):
                good = view_scores >= SCORE
                boxes.append(view.boxes_in_frame(view_boxes[good]))
                scores.append(view_scores[good])
        boxes, scores = np.concatenate(boxes), np.concatenate(scores).astype(float)
        usable = np.isfinite(boxes).all(axis=1)
        return [
            {"box": dict(zip(("x_min", "y_min", "x_max", "y_max"), box.tolist())), "score": score}
            for box, score in self.refine(boxes[usable], scores[usable])
        ]

    def tensor(self, frame: np.ndarray, views: list[View]) -> np.ndarray:
        """Some views as network input `[n, 3, size, size]`."""
        tensor = np.empty((len(views), 3, self.size, self.size), np.float32)
        for slot, view in zip(tensor, views):
            slot[:] = view.render(frame).transpose(2, 0, 1)
        return tensor

    def views_for(self, width: int) -> list[View]:
        """The views with their maps, made at the first frame of a size."""
        with self.making:
            if width not in self.views:
                lens = Lens(self.calibration, width)
                self.views[width] = [View(planned, self.size, lens) for planned in self.plan]
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
