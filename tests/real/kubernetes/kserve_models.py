"""Validates KServe's resources with the models of its Python package (PyPI `kserve`).

The package imports its server, with all of the server's dependencies; only the folder of its models is imported here.
These models refuse missing fields and ignore unknown ones, and they name Kubernetes' own types without defining them.
So this module walks along their declarations, refuses every field that is not declared, and hands Kubernetes' types to
Kubernetes' own schema.
"""

import importlib.util
import sys
import types
from collections.abc import Callable

import kubernetes_validate

_PACKAGE = types.ModuleType("kserve")
_PACKAGE.__path__ = list(importlib.util.find_spec("kserve").submodule_search_locations)
sys.modules["kserve"] = _PACKAGE

from kserve import models  # noqa: E402
from kserve.api_client import ApiClient  # noqa: E402
from kserve.constants import constants  # noqa: E402

GROUP = constants.KSERVE_GROUP
NATIVE = {"str": str, "int": int, "bool": bool, "float": (int, float)}


class InvalidResource(ValueError):
    """A resource does not fit its model."""


def validate(resource: dict, version: str) -> None:
    """Raises `InvalidResource`. `version` is that of Kubernetes."""
    name = resource["apiVersion"].removeprefix(f"{GROUP}/").capitalize() + resource["kind"]
    if not hasattr(models, name):
        raise InvalidResource(f"KServe has no model '{name}'")
    instance = _read(resource, name, resource["kind"], version)
    if ApiClient().sanitize_for_serialization(instance) != resource:
        raise InvalidResource("KServe's model does not write what it has read")


def _read(value: object, kind: str, path: str, version: str) -> object:
    """The value as an instance of a declared type."""
    if kind.startswith("list["):
        _expect(value, list, path)
        return [_read(item, kind[5:-1], f"{path}[{at}]", version) for at, item in enumerate(value)]
    if kind.startswith("dict("):
        _expect(value, dict, path)
        of = kind[5:-1].partition(", ")[2]
        return {key: _read(item, of, f"{path}.{key}", version) for key, item in value.items()}
    if kind in NATIVE:
        _expect(value, NATIVE[kind], path)
        return value
    if kind in KUBERNETES:
        _expect(value, dict, path)
        pod = {"apiVersion": "v1", "kind": "Pod"} | KUBERNETES[kind](value)
        try:
            kubernetes_validate.validate(pod, version, strict=True)
        except kubernetes_validate.ValidationError as error:
            raise InvalidResource(f"{path}: {error.message}") from error
        return value
    if not hasattr(models, kind):
        raise InvalidResource(f"{path}: no schema of '{kind}' is at hand")
    return _read_model(value, getattr(models, kind), path, version)


def _read_model(value: object, model: type, path: str, version: str) -> object:
    _expect(value, dict, path)
    fields = {key: attribute for attribute, key in model.attribute_map.items()}
    if unknown := sorted(value.keys() - fields.keys()):
        raise InvalidResource(f"{path}: {model.__name__} has no field '{unknown[0]}'")
    read = {
        fields[key]: _read(item, model.openapi_types[fields[key]], f"{path}.{key}", version)
        for key, item in value.items()
    }
    try:
        # A field that is left out has no value, not the model's default.
        return model(**(dict.fromkeys(model.openapi_types) | read))
    except ValueError as error:
        raise InvalidResource(f"{path}: {error}") from error


def _expect(value: object, kind: type | tuple, path: str) -> None:
    wrong = not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool)
    if wrong:
        raise InvalidResource(f"{path}: {value!r} is not of the type {kind}")


KUBERNETES: dict[str, Callable[[dict], dict]] = {
    "V1ObjectMeta": lambda metadata: {"metadata": metadata, "spec": {"containers": [{"name": "any"}]}},
    "V1Container": lambda container: {"metadata": {"name": "any"}, "spec": {"containers": [container]}},
}
"""The pod in which a type of Kubernetes is validated."""
