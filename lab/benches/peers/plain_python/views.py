"""Virtual views of a fisheye frame with OpenCV: maps made once, then one remap per view."""

import cv2
import numpy as np


class Lens:
    """An equidistant lens, r = f · theta, for frames of one size."""

    def __init__(self, calibration: dict, width: int):
        lens = calibration["lens"]
        if lens["model"] != "equidistant":
            raise ValueError("only equidistant lenses are known here")
        scale = width / calibration["image"]["width"]
        self.focal = lens["focal"] * scale
        self.cx = (lens["cx"] + 0.5) * scale - 0.5
        self.cy = (lens["cy"] + 0.5) * scale - 0.5
        self.max_theta = lens["max_theta"]

    def project(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Frame pixels (pixel centers) of rays `[..., 3]` in the camera frame, and which of them the lens sees."""
        across = np.hypot(rays[..., 0], rays[..., 1])
        theta = np.arctan2(across, rays[..., 2])
        scale = self.focal * theta / np.maximum(across, 1e-12)
        pixels = rays[..., :2] * scale[..., None] + [self.cx, self.cy]
        return pixels, theta <= self.max_theta

    def direction(self, pixel: np.ndarray) -> np.ndarray:
        """The unit ray `[3]` of a frame pixel (pixel center)."""
        offset = (pixel - [self.cx, self.cy]) / self.focal
        theta = max(np.hypot(*offset), 1e-9)
        return np.append(offset * np.sin(theta) / theta, np.cos(theta))


def view_of_person(box: np.ndarray, lens: Lens, fill: float = 0.3) -> dict:
    """An upright view, as of a plan, in which a box of the frame of a camera that looks down fills a part of the side."""
    middle = lens.direction((box[:2] + box[2:]) / 2 - 0.5)
    radius = np.linalg.norm(box[2:] - box[:2]) / 2 / lens.focal
    # Somewhat toward the lower edge of the frame, for a person right below the camera.
    down = np.array([0.0, 1e-6, 1.0])
    down -= down @ middle * middle
    down /= np.linalg.norm(down)
    rotation = np.stack([np.cross(down, middle), down, middle], axis=1)
    half = np.arctan(np.tan(min(radius, 0.4)) / fill)
    return {"camera_from_view": rotation.tolist(), "field_of_view_deg": float(np.degrees(2 * half))}


class View:
    """One pinhole view of `size` × `size` pixels."""

    def __init__(self, planned: dict, size: int, lens: Lens):
        self.rotation = np.array(planned["camera_from_view"])
        self.focal = size / 2 / np.tan(np.radians(planned["field_of_view_deg"]) / 2)
        self.middle = (size - 1) / 2
        self.lens = lens
        columns, rows = np.meshgrid(np.arange(size), np.arange(size))
        pixels, seen = lens.project(self.rays(columns, rows))
        pixels[~seen] = -1e4  # outside of the frame: black
        # OpenCV's remap is fastest with fixed-point maps.
        self.maps = cv2.convertMaps(pixels[..., 0].astype(np.float32), pixels[..., 1].astype(np.float32), cv2.CV_16SC2)

    def rays(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Rays in the camera frame through view pixels (pixel centers)."""
        rays = np.stack([(x - self.middle) / self.focal, (y - self.middle) / self.focal, np.ones(np.shape(x))], axis=-1)
        return rays @ self.rotation.T

    def render(self, frame: np.ndarray) -> np.ndarray:
        """Renders the view of a frame `[height, width, 3]`."""
        return cv2.remap(frame, *self.maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)

    def boxes_in_frame(self, boxes: np.ndarray) -> np.ndarray:
        """Axis-parallel hulls in the frame of the four corners of boxes `[n, 4]`; mostly invisible ones are omitted."""
        x = boxes[:, [0, 2, 2, 0]] - 0.5
        y = boxes[:, [1, 1, 3, 3]] - 0.5
        pixels, seen = self.lens.project(self.rays(x, y))
        hulls = np.concatenate([pixels.min(axis=1), pixels.max(axis=1)], axis=1) + 0.5
        hulls[seen.sum(axis=1) < 2] = np.nan
        return hulls
