"""Calls a server with the generated client: `python_client.py ADDRESS KEY IMAGE`. Prints the results as JSON."""

import datetime
import json
import sys
from pathlib import Path

from lookdown_client import AuthenticatedClient
from lookdown_client.api.calibrations import get_calibration, list_calibrations, put_calibration
from lookdown_client.api.deepstack import detect_as_deepstack_with
from lookdown_client.api.detection import detect_persons
from lookdown_client.api.results import get_latest_result, list_past_results, list_results
from lookdown_client.models import (
    CalibrationInfo,
    DeepStackAnswer,
    DeepStackForm,
    DetectForm,
    Problem,
    Profile,
    PutCalibrationJsonBody,
    Report,
)
from lookdown_client.types import File


def main(address: str, key: str, image: str) -> None:
    client = AuthenticatedClient(f"http://{address}", token=key, raise_on_unexpected_status=True)
    taken = datetime.datetime(2026, 11, 21, 9, 30, tzinfo=datetime.UTC)

    def frame() -> File:
        return File(Path(image).open("rb"), "office.jpg")

    by_arguments = detect_persons.sync(
        client=client,
        body=DetectForm(img=frame()),
        calibration="office",
        profile=Profile.FAST,
        captured_at=taken,
        motion=False,
    )
    assert isinstance(by_arguments, Report), by_arguments
    assert by_arguments.captured_at == taken
    form = DetectForm(img=frame(), calibration="office", profile=Profile.FAST, score_threshold=0.3)
    by_form = detect_persons.sync(client=client, body=form)
    assert isinstance(by_form, Report), by_form
    alone = detect_persons.sync(client=client, body=frame(), calibration="office", profile=Profile.FAST)
    assert isinstance(alone, Report), alone
    refused = detect_persons.sync(client=client, body=DetectForm(img=frame()), calibration="unknown-id")
    assert isinstance(refused, Problem), refused

    rows = list_calibrations.sync(client=client)
    assert all(isinstance(row, CalibrationInfo) for row in rows)
    office = get_calibration.sync("office", client=client)
    copied = office.to_dict() | {"id": "copy"}
    copy = put_calibration.sync("copy", client=client, body=PutCalibrationJsonBody.from_dict(copied))
    assert isinstance(copy, CalibrationInfo), copy

    latest = get_latest_result.sync("office", client=client)
    assert isinstance(latest, Report)
    assert latest.request_id == alone.request_id
    deepstack = detect_as_deepstack_with.sync(
        "copy", client=client, body=DeepStackForm(image=frame(), min_confidence=0.3)
    )
    assert isinstance(deepstack, DeepStackAnswer), deepstack
    answer = {
        "persons": [len(report.persons) for report in (by_arguments, by_form, alone)],
        "best": by_arguments.persons[0].to_dict(),
        "refused": refused.detail,
        "calibrations": [row.id for row in rows],
        "cameras": [row.camera for row in list_results.sync(client=client)],
        "past": len(list_past_results.sync("office", client=client)),
        "predictions": len(deepstack.predictions),
    }
    print(json.dumps(answer))


if __name__ == "__main__":
    main(*sys.argv[1:])
