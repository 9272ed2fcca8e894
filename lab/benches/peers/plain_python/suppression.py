"""NMS and Soft-NMS in numpy."""

import numpy as np


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
