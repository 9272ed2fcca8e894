"""Tunes NanoDet-g on composed frames, averages with the COCO weights, and exports ONNX.

    python lab/training/train.py --source WORK/frames/train --model models/nanodet_g_416/model.onnx --out WORK/runs/first --minutes 60

With `--hold`, the network keeps its first answers within persons and learns from all other cells that they are negatives:

    python lab/training/train.py --source WORK/frames/train --empty WORK/frames/train-empty --hold 2 --frozen 18 \\
        --model models/nanodet_g_fisheye_416/model.onnx --out WORK/runs/hold --minutes 30

`--source` is a folder of frames or of packed samples (samples.py). Stopped runs go on from `OUT/last.pt`. Results: the tuned
weights (`tuned.onnx`, an exponential moving average) and their average with the given model (`averaged.onnx`).
"""

import argparse
import copy
import math
import queue
import threading
import time
from pathlib import Path

import numpy as np
import torch
from losses import hold_loss, sample_losses
from network import Network, averaged, boxes_of, export

from samples import EmptyFrames, Frames, Mixed, Pack


def options_of():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--source", type=Path, required=True)
    parser.add_argument("--model", type=Path, required=True, help="the ONNX file of nanodet_g_416")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--steps", type=int, help="ends after so many steps where that is sooner")
    parser.add_argument("--batch", type=int, default=8)
    parser.add_argument("--size", type=int, default=416)
    parser.add_argument("--rate", type=float, default=4e-4, help="largest learning rate")
    parser.add_argument("--frozen", type=int, default=4, help="convolutions at the input that keep their weights")
    parser.add_argument(
        "--tiles", type=float, default=0.5, help="share of whole quarter-turn tiles; the rest are crops"
    )
    parser.add_argument("--views", type=float, default=0.0, help="share of upright perspective views among all samples")
    parser.add_argument("--empty", type=Path, help="a folder of frames without people: hard negatives")
    parser.add_argument("--empty-share", type=float, default=0.5, help="share of samples without people")
    parser.add_argument("--false-alarms", type=Path, help="COCO results in the empty frames: places of crops")
    parser.add_argument(
        "--hold",
        type=float,
        default=0.0,
        help="weight of the first answers within persons, which replace the true boxes",
    )
    parser.add_argument("--share", type=float, default=0.5, help="share of the tuned weights in the average")
    parser.add_argument("--seed", type=int, default=1_000_000)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    return parser.parse_args()


def feeder(source, o, workers=1):
    """A queue of batches that threads fill: images (n × size × size × 3), list of boxes, list of ignore flags."""
    batches = queue.Queue(8)

    def fill(number):
        rng = np.random.default_rng([o.seed, number, time.time_ns() % 2**31])
        while True:
            drawn = [source.sample(rng, o.size, o.tiles, o.views) for _ in range(o.batch)]
            batches.put((np.stack([d[0] for d in drawn]), [d[1] for d in drawn], [d[2] for d in drawn]))

    for number in range(workers):
        threading.Thread(target=fill, args=(number,), daemon=True).start()
    return batches


def optimiser_of(network, o):
    for key in list(network.weights)[: 2 * o.frozen]:
        network.weights[key].requires_grad_(False)
    trained = [p for p in network.parameters() if p.requires_grad]
    return torch.optim.AdamW(
        [
            dict(params=[p for p in trained if p.dim() == 4], weight_decay=0.02),
            dict(params=[p for p in trained if p.dim() != 4], weight_decay=0.0),
        ],
        lr=o.rate,
    ), trained


def source_of(o):
    """The samples of frames with people, mixed with those of frames without."""
    source = Frames(o.source) if (o.source / "annotations.json").exists() else Pack(o.source)
    return Mixed(source, EmptyFrames(o.empty, o.false_alarms), o.empty_share) if o.empty else source


def held_loss(network, first, batch, o):
    """Loss of a batch that keeps the answers of the network `first` within persons, and its parts (score, hold, 0)."""
    images, boxes, _ = batch
    x = torch.from_numpy(np.ascontiguousarray(images)).to(o.device).permute(0, 3, 1, 2).float()
    logits, sides, points, strides = network(x)
    with_people = [n for n in range(len(images)) if len(boxes[n])]
    with torch.no_grad():
        kept = dict(zip(with_people, zip(*first(x[with_people])[:2]))) if with_people else {}
    score = hold = logits.sum() * 0
    for n in range(len(images)):
        persons = torch.as_tensor(boxes[n], dtype=torch.float32, device=o.device)
        score = score + sample_losses(logits[n], sides[n], None, points, strides, persons[:0], persons)[0][0]
        if n in kept:
            hold = hold + hold_loss(logits[n], sides[n], *kept[n], points, persons)
    score, hold = score / len(images), hold / len(images)
    return score + o.hold * hold, torch.stack([score, hold, hold * 0]).detach()


def step_loss(network, batch, device):
    """Loss of a batch and its parts (score, box, sides) as floats."""
    images, boxes, ignore = batch
    x = torch.from_numpy(np.ascontiguousarray(images)).to(device).permute(0, 3, 1, 2).float()
    logits, sides, points, strides = network(x)
    found = boxes_of(sides, points, strides)
    parts, weight = torch.zeros(3, device=device), 0.0
    for n in range(len(images)):
        all_boxes, flags = (
            torch.as_tensor(boxes[n], dtype=torch.float32, device=device),
            torch.as_tensor(ignore[n], device=device).bool(),
        )
        loss, w = sample_losses(logits[n], sides[n], found[n], points, strides, all_boxes[~flags], all_boxes[flags])
        parts, weight = parts + loss, weight + w
    parts = parts / max(weight, 2.0)
    return parts[0] + 2 * parts[1] + 0.25 * parts[2], parts.detach()


def train(o):
    o.out.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(o.threads)
    torch.manual_seed(o.seed)
    source = source_of(o)
    network = Network(o.model).to(o.device)
    first = copy.deepcopy(network)
    optimiser, trained = optimiser_of(network, o)
    mean, step, spent, last = copy.deepcopy(network), 0, 0.0, o.out / "last.pt"
    if last.exists():
        kept = torch.load(last, map_location=o.device)
        network.load_state_dict(kept["network"])
        mean.load_state_dict(kept["mean"])
        optimiser.load_state_dict(kept["optimiser"])
        step, spent = kept["step"], kept["spent"]
    batches, start, sums = feeder(source, o, max(1, o.threads - 1)), time.time() - spent, np.zeros(4)
    save = lambda: torch.save(
        dict(
            network=network.state_dict(),
            mean=mean.state_dict(),
            optimiser=optimiser.state_dict(),
            step=step,
            spent=time.time() - start,
        ),
        last,
    )
    progress = lambda: max((time.time() - start) / (60 * o.minutes), step / o.steps if o.steps else 0.0)
    while progress() < 1:
        step += 1
        rate = o.rate * min(1, step / 40) * (0.05 + 0.475 * (1 + math.cos(math.pi * min(1, progress()))))
        for group in optimiser.param_groups:
            group["lr"] = rate
        if o.hold:
            loss, parts = held_loss(network, first, batches.get(), o)
        else:
            loss, parts = step_loss(network, batches.get(), o.device)
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(trained, 10.0)
        optimiser.step()
        decay = min(0.998, (1 + step) / (10 + step))
        with torch.no_grad():
            for a, b in zip(mean.parameters(), network.parameters()):
                a.mul_(decay).add_(b, alpha=1 - decay)
        sums += (*parts.cpu().numpy(), 1)
        if step % 20 == 0:
            each = (time.time() - start) / step / o.batch
            print(
                f"step {step}, score {sums[0] / sums[3]:.3f}, box {sums[1] / sums[3]:.3f}, sides {sums[2] / sums[3]:.3f}, "
                f"{each:.3f} s an image, {max(0, o.minutes - (time.time() - start) / 60):.0f} min left",
                flush=True,
            )
            sums[:] = 0
        if step % 200 == 0:
            save()
    save()
    export(mean, o.model, o.out / "tuned.onnx")
    mean.load_state_dict(averaged(mean.state_dict(), first.state_dict(), o.share))
    export(mean, o.model, o.out / "averaged.onnx")
    print(f"{step} steps, {step * o.batch} samples: {o.out / 'tuned.onnx'}, {o.out / 'averaged.onnx'}")


if __name__ == "__main__":
    train(options_of())
