"""Draws training samples once, as arrays that are mapped into memory, with what teachers say of each person. Numpy, OpenCV, ONNX Runtime.

    python lab/training/pool.py --frames WORK/frames/train --empty WORK/frames/train-empty --count 20000 \\
        --teacher TEACHER.onnx --workers 16 --out WORK/pools/views

`POOL/images.npy`: count × size × size × 3, RGB. `POOL/boxes.npz`: `first` (the first box of each sample), `boxes` (left, top,
right, bottom), `ignore`, `posture` (1 lying, 2 low), and `teacher`: the highest score of a teacher's box that matches, 1
without teachers.
"""

import argparse
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

import cv2
import numpy as np
from samples import EmptyFrames, Frames, Mixed, varied

CHUNK = 100
"""Samples that are drawn with one random generator: the pool does not depend on the number of workers."""
MATCH = 0.5
"""IoU from which a teacher's box is that of a person."""


def teacher_scores(boxes, found, scores):
    """For each of `boxes` (m × 4), the highest of the `scores` (n) whose box of `found` (n × 4) matches; 0 without one."""
    low, high = np.maximum(boxes[:, None, :2], found[None, :, :2]), np.minimum(boxes[:, None, 2:], found[None, :, 2:])
    inter = np.clip(high - low, 0, None).prod(2)
    area = lambda b: np.clip(b[:, 2:] - b[:, :2], 0, None).prod(1)
    iou = inter / np.maximum(area(boxes)[:, None] + area(found)[None] - inter, 1e-6)
    return np.where(iou >= MATCH, scores[None], 0).max(1, initial=0)


def source_of(o):
    """The samples of frames with people, mixed with those of frames without."""
    people = Frames(o.frames)
    return Mixed(people, EmptyFrames(o.empty), o.empty_share) if o.empty else people


def session_of(path):
    """A teacher on one thread."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    return onnxruntime.InferenceSession(str(path), options)


def draw(o, number):
    """Writes the images of chunk `number`. Returns its number, and boxes, ignore flags, teachers' scores and postures of its samples."""
    cv2.setNumThreads(1)
    teachers = [session_of(path) for path in o.teacher]
    images, source = np.load(o.out / "images.npy", mmap_mode="r+"), source_of(o)
    rng, drawn = np.random.default_rng([o.seed, number]), []
    for k in range(number * CHUNK, min(o.count, (number + 1) * CHUNK)):
        image, boxes, ignore, posture = source.sample(rng, o.size, o.crops, o.aimed, o.floor)
        images[k] = image = varied(image, rng)
        scores = np.zeros(len(boxes), np.float32) if teachers else np.ones(len(boxes), np.float32)
        for teacher in teachers if len(boxes) else ():
            given = image.transpose(2, 0, 1)[None].astype(np.float32)
            found, certain = teacher.run(["boxes", "scores"], {"images": given})
            scores = np.maximum(scores, teacher_scores(boxes, found[0], certain[0].reshape(-1)))
        drawn.append((boxes, ignore, scores, posture))
    return number, drawn


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--size", type=int, default=416)
    parser.add_argument("--crops", type=float, default=0.0, help="share of narrow views around a person")
    parser.add_argument("--aimed", type=float, default=0.0, help="share of wide views that look toward a person")
    parser.add_argument("--floor", action="store_true", help="look at people on the floor most of the time")
    parser.add_argument("--empty", type=Path, help="a folder of frames without people: hard negatives")
    parser.add_argument("--empty-share", type=float, default=0.5, help="share of samples without people")
    parser.add_argument("--teacher", type=Path, action="append", default=[], help="a model of Lookdown's contract")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1_000_000)
    o = parser.parse_args()
    o.out.mkdir(parents=True, exist_ok=True)
    shape = (o.count, o.size, o.size, 3)
    np.lib.format.open_memmap(o.out / "images.npy", "w+", np.uint8, shape).flush()
    chunks, start, samples = -(-o.count // CHUNK), time.time(), {}
    with ProcessPoolExecutor(o.workers) as workers:
        for done, job in enumerate(as_completed([workers.submit(draw, o, n) for n in range(chunks)]), 1):
            number, drawn = job.result()
            samples[number] = drawn
            if done % 10 == 0 or done == chunks:
                left = (time.time() - start) / done * (chunks - done)
                print(f"{done * CHUNK}/{o.count} samples, {left:.0f} s left", flush=True)
    boxes, ignore, teacher, posture = zip(*(sample for number in range(chunks) for sample in samples[number]))
    first = np.cumsum([0, *map(len, boxes)])
    gathered = dict(boxes=boxes, ignore=ignore, teacher=teacher, posture=posture)
    gathered = {name: np.concatenate(parts) for name, parts in gathered.items()}
    np.savez(o.out / "boxes.npz", first=first, **gathered)
    seen = np.mean(gathered["teacher"][~gathered["ignore"]] >= 0.3)
    print(f"{o.out}: {o.count} samples, {first[-1]} boxes, {100 * seen:.0f} % with a teacher's score of 0.3 or more")


if __name__ == "__main__":
    main()
