"""Tunes NanoDet-g on a pool of samples (pool.py), averages with the given weights, and exports ONNX.

    python lab/training/train.py --pool WORK/pools/views --model WORK/nanodet.onnx --out WORK/runs/first --minutes 60

With `--floor`, the second and third class learn people who lie and who are low, and the first keeps its answers everywhere.

Stopped runs go on from `OUT/last.pt`. Results: the tuned weights (`tuned.onnx`, an exponential moving average) and their
average with the given model (`averaged.onnx`).
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
from export import weights_of
from losses import ABSENT, IGNORED, PERSON, batch_losses, hold_loss, within
from network import Network, averaged, boxes_of, export


def options_of():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pool", type=Path, required=True, action="append")
    parser.add_argument("--model", type=Path, required=True, help="the ONNX file of NanoDet-g: README.md")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--steps", type=int, help="ends after so many steps where that is sooner")
    parser.add_argument("--batch", type=int, default=8)
    parser.add_argument("--rate", type=float, default=4e-4, help="largest learning rate")
    parser.add_argument("--frozen", type=int, default=4, help="convolutions at the input that keep their weights")
    parser.add_argument(
        "--least", type=float, default=0.0, help="persons with a lower score of the teachers are ignored"
    )
    parser.add_argument(
        "--full", type=float, default=0.0, help="a teachers' score below this one scales what a person's cells learn"
    )
    parser.add_argument(
        "--floor", type=float, default=0.0, help="learn people on the floor; weight of the first answers"
    )
    parser.add_argument(
        "--start", type=Path, help="a network of one class, such as a shipped one: all classes start as it"
    )
    parser.add_argument("--share", type=float, default=0.5, help="share of the tuned weights in the average")
    parser.add_argument("--seed", type=int, default=1_000_000)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    return parser.parse_args()


class Pool:
    """The samples of pool.py."""

    def __init__(self, folder):
        self.images = np.load(folder / "images.npy", mmap_mode="r")
        boxes = np.load(folder / "boxes.npz")
        self.first, self.boxes, self.ignore, self.teacher, self.posture = (
            boxes[name] for name in ("first", "boxes", "ignore", "teacher", "posture")
        )

    def samples(self, chosen, o):
        """Images (b × size × size × 3), boxes (b × g × 4), their kinds and how far to trust them (b × g)."""
        rows = [slice(self.first[k], self.first[k + 1]) for k in chosen]
        g = max(1, *(row.stop - row.start for row in rows))
        boxes, kind, trust = (np.zeros((len(rows), g, *more), np.float32) for more in ((4,), (), ()))
        for n, row in enumerate(rows):
            count, teacher = row.stop - row.start, self.teacher[row]
            boxes[n, :count] = self.boxes[row]
            known = np.array([ABSENT, PERSON, PERSON + 1])[self.posture[row]] if o.floor else PERSON
            kind[n, :count] = np.where(self.ignore[row] | (teacher < o.least), IGNORED, known)
            trust[n, :count] = np.clip(teacher / o.full, 0, 1) if o.full else 1
        return self.images[chosen], boxes, kind, trust


def feeder(o):
    """A queue of batches of all pools in equal parts, which a thread fills."""
    pools, batches, rng = [Pool(folder) for folder in o.pool], queue.Queue(8), np.random.default_rng(o.seed)

    def fill():
        turn = 0
        while True:
            pool = pools[turn % len(pools)]
            batches.put(pool.samples(np.sort(rng.integers(len(pool.images), size=o.batch)), o))
            turn += 1

    threading.Thread(target=fill, daemon=True).start()
    return batches


def varied(batch, device):
    """A batch on the device: images as floats, mirrored half of the time, with small changes of color."""
    images, boxes, kind, trust = (torch.from_numpy(np.ascontiguousarray(part)).to(device) for part in batch)
    x, size = images.permute(0, 3, 1, 2).float(), images.shape[2]
    uniform = lambda low, high, *shape: torch.empty(len(x), *shape, device=device).uniform_(low, high)
    mirrored = uniform(0, 1) < 0.5
    x = torch.where(mirrored[:, None, None, None], x.flip(3), x)
    boxes = torch.where(mirrored[:, None, None], boxes[..., [2, 1, 0, 3]] * boxes.new_tensor([-1, 1, -1, 1]), boxes)
    boxes = boxes + mirrored[:, None, None] * boxes.new_tensor([size, 0, size, 0]) * (kind != ABSENT)[..., None]
    x = x * uniform(0.9, 1.1, 1, 1, 1) + uniform(-8, 8, 1, 1, 1)
    return (x * uniform(0.97, 1.03, 3, 1, 1)).clamp(0, 255), boxes, kind, trust


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


def answers(network, x):
    """The outputs of the network, whose convolutions are computed in half precision: twice as fast on CPUs that have it."""
    with torch.autocast(x.device.type, torch.bfloat16):
        logits, sides, points, strides = network(x.contiguous(memory_format=torch.channels_last))
    return logits.float(), sides.float(), points, strides


def blended(x):
    """A batch of random mixtures of two of its images: what the first answers are asked for beside the samples."""
    share = torch.rand(len(x), 1, 1, 1, device=x.device)
    return share * x + (1 - share) * x.flip(0).roll(1, 0)


def floor_loss(network, first, batch, o):
    """Loss of a batch in which people on the floor are learned beside the first class, and its parts (score, box, hold).

    The last quarter of the images is mixed: there, only the first answers count (Beyer et al., Knowledge distillation:
    A good teacher is patient and consistent, 2021).
    """
    x, boxes, kind, trust = batch
    learned = len(x) - len(x) // 4
    x = torch.cat([x[:learned], blended(x[learned:])])
    logits, sides, points, strides = answers(network, x)
    with torch.no_grad():
        kept = answers(first, x)[:2]
    found = boxes_of(sides, points, strides)
    cut = lambda *values: [value[:learned] for value in values]
    parts, weight = batch_losses(logits[:learned, 1:], *cut(sides, found), points, strides, *cut(boxes, kind, trust))
    parts = parts / weight.clamp(2.0)
    free = within(points, boxes) & (kind >= PERSON)[..., None]
    free[learned:] = False
    hold = hold_loss(logits, sides, *kept, torch.ones_like(free[:, 0]), ~free.any(1))
    hold = hold / kept[0][:, 0].sigmoid().sum().clamp(2.0)
    return parts[0] + 2 * parts[1] + 0.25 * parts[2] + o.floor * hold, torch.stack([*parts[:2], hold]).detach()


def step_loss(network, batch):
    """Loss of a batch, and its parts (score, box, sides)."""
    x, boxes, kind, trust = batch
    logits, sides, points, strides = answers(network, x)
    found = boxes_of(sides, points, strides)
    parts, weight = batch_losses(logits, sides, found, points, strides, boxes, kind, trust)
    parts = parts / weight.clamp(2.0)
    return parts[0] + 2 * parts[1] + 0.25 * parts[2], parts.detach()


def train(o):
    o.out.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(o.threads)
    torch.manual_seed(o.seed)
    network = Network(o.model)
    if o.start:
        network.start_with(weights_of(o.start))
    network = network.to(o.device, memory_format=torch.channels_last)
    first = copy.deepcopy(network)
    optimiser, trained = optimiser_of(network, o)
    mean, step, spent, last = copy.deepcopy(network), 0, 0.0, o.out / "last.pt"
    if last.exists():
        kept = torch.load(last, map_location=o.device)
        network.load_state_dict(kept["network"])
        mean.load_state_dict(kept["mean"])
        optimiser.load_state_dict(kept["optimiser"])
        step, spent = kept["step"], kept["spent"]
    batches, start, sums = feeder(o), time.time() - spent, torch.zeros(4, device=o.device)
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
        batch = varied(batches.get(), o.device)
        loss, parts = floor_loss(network, first, batch, o) if o.floor else step_loss(network, batch)
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(trained, 10.0)
        optimiser.step()
        decay = min(0.998, (1 + step) / (10 + step))
        with torch.no_grad():
            for a, b in zip(mean.parameters(), network.parameters()):
                a.mul_(decay).add_(b, alpha=1 - decay)
        sums += torch.cat([parts, parts.new_ones(1)])
        if step % 20 == 0:
            each = (time.time() - start) / step / o.batch
            print(
                f"step {step}, score {sums[0] / sums[3]:.3f}, box {sums[1] / sums[3]:.3f}, sides {sums[2] / sums[3]:.3f}, "
                f"{each:.3f} s an image, {max(0, o.minutes - (time.time() - start) / 60):.0f} min left",
                flush=True,
            )
            sums.zero_()
        if step % 200 == 0:
            save()
    save()
    export(mean, o.model, o.out / "tuned.onnx")
    mean.load_state_dict(averaged(mean.state_dict(), first.state_dict(), o.share))
    export(mean, o.model, o.out / "averaged.onnx")
    print(f"{step} steps, {step * o.batch} samples: {o.out / 'tuned.onnx'}, {o.out / 'averaged.onnx'}")


if __name__ == "__main__":
    train(options_of())
