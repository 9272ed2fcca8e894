"""A typical person detector for fisheye frames in Python: FastAPI, OpenCV and ONNX Runtime.

Serves `POST /detect` (the frame as the body). Settings: MODEL, PLAN and CALIBRATION (files), REFINE (`nms` or
`soft_nms`), THREADS (of one run of the network), BATCH (views in a run), FRAMES (worked on at once).
"""

import asyncio
import json
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from detector import Detector
from fastapi import FastAPI, Request


def setting(name: str) -> str:
    """A setting from the environment."""
    return os.environ[name]


app = FastAPI()
workers = ThreadPoolExecutor(int(setting("FRAMES")))
detector = Detector(
    setting("MODEL"),
    json.loads(Path(setting("PLAN")).read_text()),
    json.loads(Path(setting("CALIBRATION")).read_text()),
    setting("REFINE"),
    int(setting("THREADS")),
    int(setting("BATCH")),
)


@app.get("/ready")
def ready() -> dict:
    """The model is loaded."""
    return {"ready": True}


@app.post("/detect")
async def detect(request: Request) -> dict:
    """The persons in a frame."""
    frame = await request.body()
    persons = await asyncio.get_running_loop().run_in_executor(workers, detector.detect, frame)
    return {"persons": persons}
