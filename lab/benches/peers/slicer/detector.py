"""Sliced inference as `supervision` documents it: its `InferenceSlicer` over the fisheye frame as it is, with ONNX Runtime.

Setting beside those of `app.py`: SLICE (side of a slice in frame pixels; neighbors overlap by a fifth). BATCH is not used:
the slicer hands over one slice at a time, from THREADS threads.
"""

from collections.abc import Mapping

import cv2
import numpy as np
import onnxruntime
import supervision

SCORE = 0.3
"""The minimum score of a person."""
SLICE_IOU, MERGED_IOU = 0.6, 0.5
"""Boxes that overlap at least so much are one person: within a slice, and of different slices."""
OVERLAP = 0.2


class Detector:
    """Finds persons in frames."""

    def __init__(self, settings: Mapping[str, str]):
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = int(settings["THREADS"])
        side = int(settings["SLICE"])
        self.session = onnxruntime.InferenceSession(settings["MODEL"], options, providers=["CPUExecutionProvider"])
        self.size = self.session.get_inputs()[0].shape[2]
        self.slicer = supervision.InferenceSlicer(
            callback=self.persons_of,
            slice_wh=(side, side),
            overlap_wh=(round(side * OVERLAP),) * 2,
            overlap_filter=supervision.OverlapFilter.NON_MAX_SUPPRESSION,
            iou_threshold=MERGED_IOU,
            thread_workers=int(settings["FRAMES"]),
        )

    def detect(self, jpeg: bytes) -> list[dict]:
        """The persons in a frame."""
        frame = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
        found = self.slicer(frame)
        return [
            {"box": dict(zip(("x_min", "y_min", "x_max", "y_max"), box.tolist())), "score": float(score)}
            for box, score in zip(found.xyxy, found.confidence)
        ]

    def persons_of(self, piece: np.ndarray) -> supervision.Detections:
        """The persons of a slice (blue, green, red), which is scaled to the input of the network."""
        longest = max(piece.shape[:2])
        scaled = cv2.resize(piece, None, fx=self.size / longest, fy=self.size / longest, interpolation=cv2.INTER_LINEAR)
        tensor = np.zeros((1, 3, self.size, self.size), np.float32)
        tensor[0, :, : scaled.shape[0], : scaled.shape[1]] = scaled[..., ::-1].transpose(2, 0, 1)
        boxes, scores = (output[0] for output in self.session.run(["boxes", "scores"], {"images": tensor}))
        good = scores >= SCORE
        found = supervision.Detections(
            xyxy=np.clip(boxes[good] * (longest / self.size), 0, (*piece.shape[1::-1],) * 2),
            confidence=scores[good],
            class_id=np.zeros(int(good.sum()), int),
        )
        return found.with_nms(SLICE_IOU)
