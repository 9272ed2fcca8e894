"""Writes a CycloneDX 1.6 bill of materials of Lookdown as JSON: `sbom.py [FILE]`, standard output by default.

The crates that the binary is built from, from `cargo metadata` and Cargo.lock; ONNX Runtime and the models, from
pins.toml and the models' manifests. The same sources give the same bytes.
"""

import json
import subprocess
import sys
import tomllib
import uuid
from pathlib import Path
from urllib.parse import quote

from assets.machine import supported_cpu
from assets.runtime import pinned_runtime

ROOT = Path(__file__).resolve().parents[2]
# Our networks: every package has them.
MODELS = tuple(
    f"nanodet_g_{views}_416{precision}" for views in ("views", "fisheye", "floor") for precision in ("", "_fp16")
)
NOT_STATED = "NOASSERTION"
# A namespace of our own; the identifiers that are derived from it must never change.
NAMESPACE = uuid.UUID("6c1f4a52-3c0e-4b57-9f59-0f6b1f0f6d35")


def main(arguments: list[str]) -> int:
    """Writes the bill of materials for the CPU family of this machine."""
    cpu = supported_cpu()
    text = json.dumps(bill_of_materials(ROOT, cpu, cargo_metadata(ROOT, cpu)), indent=2, ensure_ascii=False) + "\n"
    if arguments:
        file = Path(arguments[0])
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    else:
        sys.stdout.write(text)
    return 0


def cargo_metadata(root: Path, cpu: str) -> dict:
    """The metadata of the crates and their dependencies for this CPU family, from cargo."""
    command = ["cargo", "metadata", "--locked", "--format-version=1", f"--filter-platform={cpu}-unknown-linux-gnu"]
    return json.loads(subprocess.run(command, cwd=root, check=True, capture_output=True).stdout)


def bill_of_materials(root: Path, cpu: str, metadata: dict) -> dict:
    """The document, reproducible between runs."""
    needs = needed_crates(metadata)
    sums = checksums((root / "Cargo.lock").read_text(encoding="utf-8"))
    packages = {package["id"]: package for package in metadata["packages"]}
    own = packages[metadata["resolve"]["root"]]
    crates = [crate(package, sums) for package in packages.values() if package["id"] in needs and package is not own]
    runtime = onnx_runtime(cpu)
    models = [model(root, name) for name in MODELS]
    application = identity("application", reference(own), own["name"], own["version"])
    application["licenses"] = licenses(own["license"])
    dependencies = {
        reference(packages[needing]): {reference(packages[needed]) for needed in needs[needing]} for needing in needs
    }
    dependencies[application["bom-ref"]] |= {part["bom-ref"] for part in [runtime, *models]}
    document = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": application, "lifecycles": [{"phase": "build"}]},
        "components": sorted([*crates, runtime, *models], key=lambda part: part["bom-ref"]),
        "dependencies": [{"ref": ref, "dependsOn": sorted(needed)} for ref, needed in sorted(dependencies.items())],
    }
    return {"serialNumber": f"urn:uuid:{uuid.uuid5(NAMESPACE, json.dumps(document, sort_keys=True))}"} | document


def needed_crates(metadata: dict) -> dict[str, set[str]]:
    """The crates of the binary, its own included, with their dependencies, without dev-dependencies.

    Those of build scripts belong to it: the web page of the API comes from one.
    """
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    needs: dict[str, set[str]] = {}
    waiting = [metadata["resolve"]["root"]]
    while waiting:
        package = waiting.pop()
        if package not in needs:
            needs[package] = {
                need["pkg"]
                for need in nodes[package]["deps"]
                if any(kind["kind"] != "dev" for kind in need["dep_kinds"])
            }
            waiting.extend(needs[package])
    return needs


def checksums(lock: str) -> dict[tuple[str, str], str]:
    """The sha256 sums of Cargo.lock, by name and version."""
    packages = tomllib.loads(lock)["package"]
    return {(entry["name"], entry["version"]): entry["checksum"] for entry in packages if "checksum" in entry}


def reference(package: dict) -> str:
    """The reference of a crate in the document."""
    return purl("cargo", package["name"], package["version"])


def crate(package: dict, sums: dict[tuple[str, str], str]) -> dict:
    """The component for a crate of a registry, or of this repository, which has no sum."""
    name, version = package["name"], package["version"]
    sum_ = sums.get((name, version))
    return identity("library", reference(package), name, version) | {
        **({"hashes": hashes(sum_)} if sum_ else {}),
        # Cargo's old form of OR.
        "licenses": licenses((package["license"] or NOT_STATED).replace("/", " OR ")),
        "purl": reference(package),
    }


def onnx_runtime(cpu: str) -> dict:
    """The component of ONNX Runtime."""
    pinned = pinned_runtime(cpu)
    package = purl("pypi", "onnxruntime", pinned.version)
    return identity("library", package, "onnxruntime", pinned.version) | {
        "hashes": hashes(pinned.sha256),
        "licenses": licenses("MIT"),
        "purl": package,
    }


def model(root: Path, name: str) -> dict:
    """The component for one of our networks."""
    manifest = tomllib.loads((root / "models" / name / "model.toml").read_text(encoding="utf-8"))
    return identity("machine-learning-model", f"model:{name}", name, manifest["sha256"][:12]) | {
        "description": manifest["source"],
        "hashes": hashes(manifest["sha256"]),
        "licenses": licenses(manifest["license"]),
    }


def identity(kind: str, name_here: str, name: str, version: str) -> dict:
    """The common fields of every component."""
    return {"type": kind, "bom-ref": name_here, "name": name, "version": version}


def purl(registry: str, name: str, version: str) -> str:
    """The package URL (purl)."""
    return f"pkg:{registry}/{quote(name)}@{quote(version)}"


def hashes(sha256: str) -> list[dict]:
    """The one sum of a component."""
    return [{"alg": "SHA-256", "content": sha256}]


def licenses(expression: str) -> list[dict]:
    """An SPDX expression, or the statement that none is given."""
    if expression == NOT_STATED:
        return [{"license": {"name": "not stated"}}]
    return [{"expression": expression}]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
