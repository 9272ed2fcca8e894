"""The files that come with the package: the default models, and ONNX Runtime of the package `onnxruntime`."""

import importlib.util
from functools import cache
from pathlib import Path

from lookdown import _lookdown

MODELS = Path(__file__).parent / "models"


@cache
def use_packaged_files() -> None:
    """Makes these files the defaults of the settings `model.repository` and `inference.library_path`."""
    _lookdown.use_files(runtime_library(), MODELS)


def runtime_library() -> Path:
    """Returns the library of the installed package `onnxruntime`, which is not imported."""
    spec = importlib.util.find_spec("onnxruntime")
    folders = spec.submodule_search_locations if spec else None
    libraries = [path for folder in folders or [] for path in Path(folder, "capi").glob("libonnxruntime.so.*")]
    if not libraries:
        raise _lookdown.LookdownError("ONNX Runtime is missing: install it with `pip install onnxruntime`")
    return libraries[0]
