"""Runs networks on ready tensors with bare ONNX Runtime, and prints the frames per second.

bare_onnx.py SIDE SESSIONS THREADS BATCH SECONDS MODEL:RUNS...: so many sessions of each model at once, of so many threads
each. A frame is so many images of SIDE pixels for each model.
"""

import sys
import threading
import time

import numpy as np
import onnxruntime


def main(side: int, sessions: int, threads: int, batch: int, seconds: float, runs: dict[str, int]) -> float:
    """The frames per second of all sessions together."""
    images = np.random.default_rng(0).integers(0, 256, (max(runs.values()), 3, side, side)).astype(np.float32)
    warm, end = threading.Barrier(sessions), [0.0]
    rates = [0.0] * sessions

    def work(index: int) -> None:
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = threads
        batches = []
        for model, count in runs.items():
            session = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
            batches += [(session, images[start : min(start + batch, count)]) for start in range(0, count, batch)]
        for session, tensor in batches:
            session.run(None, {"images": tensor})
        if warm.wait() == 0:
            end[0] = time.monotonic() + seconds
        warm.wait()
        done, began = 0, time.monotonic()
        while time.monotonic() < end[0]:
            session, tensor = batches[done % len(batches)]
            session.run(None, {"images": tensor})
            done += 1
        rates[index] = done / len(batches) / (time.monotonic() - began)

    workers = [threading.Thread(target=work, args=(index,)) for index in range(sessions)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    return sum(rates)


if __name__ == "__main__":
    side, sessions, threads, batch, seconds, *models = sys.argv[1:]
    runs = {model: int(count) for model, _, count in (word.rpartition(":") for word in models)}
    print(main(int(side), int(sessions), int(threads), int(batch), float(seconds), runs))
