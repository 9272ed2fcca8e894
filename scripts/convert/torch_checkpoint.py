"""Reads the tensors of a PyTorch checkpoint (`.pth`, a zip archive) without PyTorch.

A checkpoint is a pickle, which could run anything. Here nothing but tensors and plain containers is made of it;
whatever else it names becomes a husk.
"""

import collections
import pickle
import zipfile
from pathlib import Path

import numpy

from .errors import ConversionError

STORAGES = {
    "FloatStorage": numpy.float32,
    "HalfStorage": numpy.float16,
    "DoubleStorage": numpy.float64,
    "LongStorage": numpy.int64,
    "IntStorage": numpy.int32,
    "ByteStorage": numpy.uint8,
    "BoolStorage": numpy.bool_,
}


def read_checkpoint(file: Path) -> dict:
    """The saved object, with tensors as numpy arrays."""
    try:
        with zipfile.ZipFile(file) as archive:
            pickled = next((name for name in archive.namelist() if name.endswith("/data.pkl")), None)
            if pickled is None:
                raise ConversionError(f"{file.name} holds no data.pkl; is it a PyTorch checkpoint?")
            with archive.open(pickled) as stream:
                return _Reader(stream, archive, pickled.removesuffix("data.pkl")).load()
    except zipfile.BadZipFile:
        raise ConversionError(f"{file.name} is not a zip archive, as PyTorch writes since 1.6; is it whole?") from None
    except (pickle.UnpicklingError, AttributeError, EOFError, IndexError, KeyError, TypeError, ValueError) as error:
        raise ConversionError(f"{file.name} cannot be read as a PyTorch checkpoint: {error!r}.") from None


class _Husk:
    """A placeholder for objects of other classes."""

    def __init__(self, *_arguments, **_named):
        pass

    def __setstate__(self, state):
        pass


class _Reader(pickle.Unpickler):
    def __init__(self, stream, archive: zipfile.ZipFile, folder: str):
        super().__init__(stream)
        self._archive = archive
        self._folder = folder

    def find_class(self, module, name):
        match module, name:
            case "collections", "OrderedDict":
                return collections.OrderedDict
            case "torch._utils", "_rebuild_tensor_v2":
                return _tensor
            case "torch._utils", "_rebuild_parameter":
                return lambda tensor, *_: tensor
            case "torch", storage if storage in STORAGES:
                return STORAGES[storage]
        return _Husk

    def persistent_load(self, pid):
        _, element_type, key, *_ = pid
        return numpy.frombuffer(self._archive.read(f"{self._folder}data/{key}"), element_type)


def _tensor(storage: numpy.ndarray, offset: int, shape: tuple[int, ...], strides: tuple[int, ...], *_) -> numpy.ndarray:
    last = offset + sum((extent - 1) * stride for extent, stride in zip(shape, strides, strict=True))
    if min(shape, default=1) < 0 or min(strides, default=0) < 0 or offset < 0 or last >= max(storage.size, 1):
        raise ValueError(f"a tensor of shape {shape} lies outside its storage of {storage.size} numbers")
    bytes_apart = [stride * storage.itemsize for stride in strides]
    return numpy.lib.stride_tricks.as_strided(storage[offset:], shape, bytes_apart).copy()
