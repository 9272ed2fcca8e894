"""Runs a network on ready tensors with bare ONNX Runtime, and prints the views per second.

bare_onnx.py MODEL VIEWS.npy SESSIONS THREADS BATCH SECONDS: so many sessions at once, of so many threads each, and
VIEWS.npy holds the views of a frame as bytes [views, 3, height, width].
"""

import sys
import threading
import time

import numpy as np
import onnxruntime


def main(model: str, views_file: str, sessions: int, threads: int, batch: int, seconds: float) -> float:
    """The views per second of all sessions together."""
    views = np.load(views_file).astype(np.float32)
    batches = [views[start : start + batch] for start in range(0, len(views), batch)]
    warm, end = threading.Barrier(sessions), [0.0]
    rates = [0.0] * sessions

    def work(index: int) -> None:
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = threads
        session = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
        for tensor in batches:
            session.run(None, {"images": tensor})
        if warm.wait() == 0:
            end[0] = time.monotonic() + seconds
        warm.wait()
        done, turn, began = 0, 0, time.monotonic()
        while time.monotonic() < end[0]:
            tensor = batches[turn % len(batches)]
            session.run(None, {"images": tensor})
            done, turn = done + len(tensor), turn + 1
        rates[index] = done / (time.monotonic() - began)

    workers = [threading.Thread(target=work, args=(index,)) for index in range(sessions)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    return sum(rates)


if __name__ == "__main__":
    model, views_file, sessions, threads, batch, seconds = sys.argv[1:]
    print(main(model, views_file, int(sessions), int(threads), int(batch), float(seconds)))
