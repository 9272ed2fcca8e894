"""Sends a frame with the client of openapi-generator: `detect.py ADDRESS IMAGE`. Prints the number of persons."""

import sys

from openapi_client import ApiClient, Configuration, DetectionApi, Profile

with ApiClient(Configuration(host=sys.argv[1])) as client:
    report = DetectionApi(client).detect_persons(sys.argv[2], calibration="office", profile=Profile.FAST)
    print(len(report.persons))
