"""Label Studio itself with Lookdown: `application.py LABEL_STUDIO`, where `LABEL_STUDIO` is the program of its package.

Starts Label Studio on SQLite in a temporary folder, and Lookdown (the release binary, or the one that
`LOOKDOWN_BINARY` names). Imports the tasks of `lookdown detect --format labelstudio` and reads the predictions and
the image back; then connects the example's backend and lets Label Studio ask it for predictions. Exits with 1 if a
step fails. See docs/evaluate.md for the installation.
"""

import contextlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

REAL = Path(__file__).resolve().parents[1]
for folder in (REAL, REAL.parent / "reliability", REAL.parents[1] / "lab/benches"):
    sys.path.insert(0, str(folder))

from harness.places import LOOKDOWN, ROOT, SAMPLES  # noqa: E402
from harness.processes import free_ports  # noqa: E402
from support.lookdown import lookdown  # noqa: E402
from waiting import wait_until  # noqa: E402

START_SECONDS = 1800.0
USER, PASSWORD, TOKEN = "user@lookdown.local", "of-the-test-1", "0123456789abcdef0123456789abcdef01234567"
SILENT = {
    "COLLECT_ANALYTICS": "false",
    "FEATURE_FLAGS_OFFLINE": "true",
    "FRONTEND_SENTRY_DSN": "",
    "LATEST_VERSION_CHECK": "false",
    "SENTRY_DSN": "",
}
"""Settings without which Label Studio opens connections to its makers."""


class LabelStudio:
    """A Label Studio that answers."""

    def __init__(self, address: str):
        self.address = address

    def call(self, method: str, path: str, body: object = None) -> object:
        """The answer of the API, decoded if it is JSON."""
        headers = {"Authorization": f"Token {TOKEN}", "Content-Type": "application/json"}
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(f"{self.address}{path}", data=data, headers=headers, method=method)
        try:
            with urllib.request.urlopen(request, timeout=120) as answer:
                content = answer.read()
        except urllib.error.HTTPError as error:
            raise AssertionError(f"{method} {path}: {error.code} {error.read()[:1000]!r}") from error
        try:
            return json.loads(content)
        except ValueError:
            return content

    def tasks(self, project: int) -> list[dict]:
        """The tasks of a project with their predictions."""
        found = self.call("GET", f"/api/tasks?project={project}&fields=all&page_size=100")
        return found["tasks"]


@contextlib.contextmanager
def label_studio(program: str, folder: Path, root: Path) -> Iterator[LabelStudio]:
    """Starts the program, waits until it answers, and stops it at the end."""
    (port,) = free_ports(1)
    address = f"http://127.0.0.1:{port}"
    settings = SILENT | {
        "LABEL_STUDIO_BASE_DATA_DIR": str(folder),
        "LABEL_STUDIO_ENABLE_LEGACY_API_TOKEN": "true",
        "LABEL_STUDIO_HOST": address,
        "LOCAL_FILES_DOCUMENT_ROOT": str(root),
        "LOCAL_FILES_SERVING_ENABLED": "true",
        # The backend of the example is at a loopback address, which Label Studio otherwise refuses.
        "USE_DEFAULT_BANNED_SUBNETS": "false",
    }
    command = [program, "start", "--no-browser", "--internal-host", "127.0.0.1", "--port", str(port)]
    command += ["--username", USER, "--password", PASSWORD, "--user-token", TOKEN]
    log = folder / "output.log"
    with log.open("ab") as output:
        process = subprocess.Popen(command, env=os.environ | settings, cwd=folder, stdout=output, stderr=output)
    try:

        def answers() -> bool:
            if process.poll() is not None:
                raise AssertionError(f"Label Studio has ended: {log.read_text()[-3000:]}")
            with contextlib.suppress(OSError, AssertionError):
                LabelStudio(address).call("GET", "/api/projects")
                return True
            return False

        wait_until(answers, "Label Studio answers", START_SECONDS)
        yield LabelStudio(address)
    except AssertionError:
        print(log.read_text()[-3000:], file=sys.stderr)
        raise
    finally:
        process.terminate()
        process.wait()


def configuration() -> str:
    """The labeling configuration of the documentation."""
    text = (ROOT / "docs" / "evaluate.md").read_text(encoding="utf-8")
    return text[text.index("    <View>") : text.index("</View>") + len("</View>")]


def create_project(studio: LabelStudio, title: str, root: Path) -> int:
    """A project whose local storage is the subfolder `images`: Label Studio refuses the root itself."""
    project = studio.call("POST", "/api/projects", {"title": title, "label_config": configuration()})["id"]
    storage = {"project": project, "path": str(root / "images"), "title": "images", "use_blob_urls": True}
    studio.call("POST", "/api/storages/localfiles", storage)
    return project


def import_tasks(studio: LabelStudio, root: Path, folder: Path) -> None:
    """Imports the tasks of `lookdown detect`, and compares predictions and images with what comes back."""
    flags = ["--profile", "fast", "--score-threshold", "0.3", "--format", "labelstudio", "--oriented"]
    subprocess.run([LOOKDOWN, "detect", root, *flags, "--out", folder], check=True)
    tasks = json.loads((folder / "tasks.json").read_text(encoding="utf-8"))
    project = create_project(studio, "files", root)
    imported = studio.call("POST", f"/api/projects/{project}/import", tasks)
    assert (imported["task_count"], imported["prediction_count"]) == (len(tasks), len(tasks)), imported
    found = {task["data"]["image"]: task for task in studio.tasks(project)}
    for task in tasks:
        ((prediction,), (expected,)) = found[task["data"]["image"]]["predictions"], task["predictions"]
        regions = [region["value"] for region in prediction["result"]]
        assert regions == [region["value"] for region in expected["result"]], (regions, expected)
        assert regions and all(value["rectanglelabels"] == ["person"] for value in regions), regions
        assert prediction["model_version"] == expected["model_version"], prediction
        name = task["data"]["image"].partition("?d=")[2]
        served = studio.call("GET", task["data"]["image"])
        assert served == (root / name).read_bytes(), f"{name} is not served"
        print(f"{name}: {len(regions)} regions, the image is served")


def ask_the_backend(studio: LabelStudio, root: Path, server: str) -> None:
    """Imports an image, connects the backend of the example, and reads its predictions from Label Studio."""
    (port,) = free_ports(1)
    project = create_project(studio, "backend", root)
    studio.call("POST", f"/api/projects/{project}/import", [{"image": "/data/local-files/?d=images/office.jpg"}])
    environment = os.environ | {"LABEL_STUDIO_URL": studio.address, "LABEL_STUDIO_TOKEN": TOKEN}
    example = ROOT / "examples" / "label_studio_backend.py"
    command = [sys.executable, example, "--server", server, "--port", str(port), "--profile", "fast"]
    with subprocess.Popen(list(map(str, command)), env=environment) as backend:
        try:
            wait_until(lambda: answers(f"http://127.0.0.1:{port}/health"), "the backend answers")
            model = {"project": project, "url": f"http://127.0.0.1:{port}", "title": "lookdown"}
            studio.call("POST", "/api/ml", model)
            chosen = {"selectedItems": {"all": True, "excluded": []}}
            studio.call("POST", f"/api/dm/actions?id=retrieve_tasks_predictions&project={project}", chosen)
            (found,) = wait_until(
                lambda: [item for item in studio.tasks(project) if item["predictions"]], "there are predictions", 120
            )
        finally:
            backend.terminate()
    (prediction,) = found["predictions"]
    assert prediction["result"], prediction
    print(f"the backend: {len(prediction['result'])} regions of model {prediction['model_version']}")


def answers(address: str) -> bool:
    """Returns true if a server answers."""
    with contextlib.suppress(OSError):
        urllib.request.urlopen(address, timeout=5).close()
        return True
    return False


def main(program: str) -> None:
    """Runs all steps."""
    started = time.monotonic()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        root, data = folder / "root", folder / "data"
        (root / "images").mkdir(parents=True)
        data.mkdir()
        for sample in ("office.jpg", "canteen.jpg"):
            shutil.copy(SAMPLES / sample, root / "images")
        with label_studio(program, data, root) as studio:
            print(f"Label Studio answers after {time.monotonic() - started:.0f} s")
            import_tasks(studio, root, folder / "tasks")
            with lookdown({}) as server:
                ask_the_backend(studio, root, f"http://{server.address}")
    print(f"everything is right after {time.monotonic() - started:.0f} s")


if __name__ == "__main__":
    main(sys.argv[1])
