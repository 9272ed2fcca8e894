"""The compiled part of the package."""

import os

import numpy as np
import numpy.typing as npt

class LookdownError(ValueError):
    """A value, file or frame that cannot be used. The text names it and the remedy."""

class Lens:
    """A fisheye lens. The center of the top-left pixel is (0, 0); rays are in the camera frame of OpenCV."""

    @property
    def model(self) -> str:
        """Name of the lens model, such as "kannala_brandt"."""
    @property
    def max_theta(self) -> float:
        """Largest angle from the optical axis, radians."""
    @property
    def principal_point(self) -> tuple[float, float]:
        """Pixel of the optical axis, (x, y)."""
    def project(self, rays: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Projects rays of shape (N, 3) and any length to pixels of shape (N, 2). NaN beyond the lens."""
    def unproject(self, pixels: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Converts pixels of shape (N, 2) to unit rays of shape (N, 3). NaN beyond the lens."""

class Calibration:
    """A camera: its lens, mount, zones and masks."""

    @staticmethod
    def read(path: str | os.PathLike[str], camera: str | None = None) -> Calibration:
        """Reads a calibration file of any format. `camera` names one of several cameras of a file."""
    @property
    def id(self) -> str:
        """The ID, from the file or its name."""
    @property
    def revision(self) -> str:
        """Twelve hexadecimal digits that change with the content of the file."""
    def to_json(self) -> str:
        """Returns the calibration in the native format, whatever format its file has."""
    @property
    def image_size(self) -> tuple[int, int]:
        """Width and height of the frames, pixels."""
    @property
    def height_m(self) -> float | None:
        """Height of the camera above the floor, meters, if the file has it."""
    @property
    def lens(self) -> Lens:
        """The lens, in pixels of frames of `image_size`."""

class View:
    """An upright perspective view of a part of the frame, as the network receives it."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
    @property
    def focal(self) -> float:
        """Focal length, pixels."""
    @property
    def principal_point(self) -> tuple[float, float]:
        """Principal point, (x, y)."""
    @property
    def camera_from_view(self) -> npt.NDArray[np.float64]:
        """Rotation from the view frame to the camera frame, of shape (3, 3)."""
    @property
    def axis(self) -> npt.NDArray[np.float64]:
        """Direction of the axis in the camera frame, of shape (3,)."""
    @property
    def outline(self) -> npt.NDArray[np.float64]:
        """Border in the frame, clockwise from the top left corner, of shape (N, 2)."""
    def maps(self) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
        """Returns the position in the frame of each pixel of the view, as two arrays of shape (height, width) for
        `cv2.remap`. NaN beyond the lens."""

class Detector:
    """Finds persons in frames. May be used by several threads."""

    def __new__(cls, parameters: dict[str, str], config: str | os.PathLike[str] | None = None) -> Detector: ...
    def detect_file(self, content: bytes, name: str, calibration: Calibration | None = None) -> str:
        """Detects persons in the content of an image file. Returns the report as JSON."""
    def detect_pixels(self, pixels: npt.NDArray[np.uint8], name: str, calibration: Calibration | None = None) -> str:
        """Detects persons in RGB pixels of shape (height, width, 3). Returns the report as JSON."""
    def views(self, calibration: Calibration) -> list[View]:
        """Returns the views of the profile, in the order in which the network receives them."""

def calibrate(
    images: list[bytes | npt.NDArray[np.uint8]],
    id: str,
    height_m: float | None = None,
    lens: str | None = None,
    field_of_view_deg: float | None = None,
    ceiling: bool = False,
) -> tuple[Calibration, bytes]:
    """Calibrates a camera from frames of one size. Returns a preview of the fit as a JPEG, too."""

def read_image(path: str | os.PathLike[str]) -> bytes:
    """Returns the content of an image file: a regular file, with a limit of its size."""

def run(arguments: list[str]) -> bool:
    """Runs the command line. Returns true if it succeeded. Ends the process if a flag is invalid."""

def use_files(library: str | os.PathLike[str], models: str | os.PathLike[str]) -> None:
    """Uses the files of the package where settings have their default paths."""
