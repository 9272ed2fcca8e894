"""The web server of the peers in Python: FastAPI around the `Detector` of the peer's own `detector` module.

Serves `POST /detect` (the frame as the body). Settings are environment variables: MODEL (a file), FRAMES (worked on at
once), THREADS (of one run of the network), BATCH (images in a run), and those of the peer.
"""

import asyncio
import os
from concurrent.futures import ThreadPoolExecutor

from detector import Detector
from fastapi import FastAPI, Request

app = FastAPI()
workers = ThreadPoolExecutor(int(os.environ["FRAMES"]))
detector = Detector(os.environ)


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
