"""The losses of NanoDet for a batch: quality focal loss for scores, GIoU for boxes, distribution focal loss for sides; SimOTA assignment.

Shapes: b images, c classes, n cells, g boxes of the fullest image. Boxes are left, top, right, bottom in pixels. `kind` (b × g)
tells what a box is: `ABSENT` fills the rows of images with fewer boxes, and `PERSON` is the first class.
"""

import torch
import torch.nn.functional as F
from network import BINS

LARGEST_SIDE = BINS - 1.01
"""The largest distance from a cell to a box side, in strides, that the distribution can express."""
ABSENT, IGNORED, PERSON = 0, 1, 2
MOST_CELLS = 10
"""The most cells that answer for one person."""


def pair_iou(a, b):
    """IoU of all pairs: `a` b × g × 4, `b` b × n × 4, to b × g × n."""
    a, b = a[:, :, None], b[:, None]
    inter = (torch.min(a[..., 2:], b[..., 2:]) - torch.max(a[..., :2], b[..., :2])).clamp(0).prod(-1)
    area = lambda x: (x[..., 2:] - x[..., :2]).clamp(0).prod(-1)
    return inter / (area(a) + area(b) - inter).clamp(1e-6)


def iou_and_giou(a, b):
    """IoU and generalized IoU of boxes one by one."""
    inter = (torch.min(a[:, 2:], b[:, 2:]) - torch.max(a[:, :2], b[:, :2])).clamp(0).prod(1)
    union = (a[:, 2:] - a[:, :2]).clamp(0).prod(1) + (b[:, 2:] - b[:, :2]).prod(1) - inter
    hull = (torch.max(a[:, 2:], b[:, 2:]) - torch.min(a[:, :2], b[:, :2])).clamp(0).prod(1)
    iou = inter / union.clamp(1e-6)
    return iou, iou - (hull - union) / hull.clamp(1e-6)


def within(points, boxes):
    """Which cells lie in which boxes: b × g × n."""
    return ((points > boxes[:, :, None, :2]) & (points < boxes[:, :, None, 2:])).all(-1)


def assign(logits, found, points, strides, truth, kind):
    """SimOTA: which cells answer for which true box. Returns the positive cells (b × n) and the box of each cell (b × n)."""
    person = (kind >= PERSON)[..., None]
    centre = (truth[..., :2] + truth[..., 2:]) / 2
    off = (points - centre[:, :, None]).abs()
    sides = torch.cat([points - truth[:, :, None, :2], truth[:, :, None, 2:] - points], -1).amax(-1) / strides
    near = (off < 2.5 * strides[:, None]).all(-1)
    allowed = within(points, truth) & near & (sides < LARGEST_SIDE)
    # A box smaller than a cell: its nearest fine cell.
    distance = off.pow(2).sum(-1) + 1e6 * (sides >= LARGEST_SIDE) + 1e3 * (strides > strides.min())
    nearest = torch.zeros_like(allowed).scatter(2, distance.argmin(2, keepdim=True), True)
    allowed = torch.where(allowed.any(2, keepdim=True), allowed, nearest) & person
    iou, score = pair_iou(truth, found), logits.amax(1).sigmoid()[:, None]
    entropy = -(iou * score.clamp(1e-7).log() + (1 - iou) * (1 - score).clamp(1e-7).log())
    cost = (
        entropy * (iou - score).pow(2) - 3 * (iou + 1e-7).log() + 0.3 * (off / strides[:, None]).pow(2).sum(-1).sqrt()
    )
    cost = cost + 1e5 * ~allowed
    count = allowed.sum(2)
    wanted = (iou * allowed).topk(MOST_CELLS, 2).values.sum(2).clamp(1).long().minimum(count)
    cheapest = cost.topk(MOST_CELLS, 2, largest=False).indices
    taken = torch.arange(MOST_CELLS, device=cost.device) < wanted[..., None]
    chosen = torch.zeros_like(allowed).scatter(2, cheapest, taken)
    # A cell that several boxes chose answers for the one with the least cost.
    best = cost.masked_fill(~chosen, torch.inf).argmin(1)
    return chosen.any(1), best


def hold_loss(logits, sides, first_logits, first_sides, held, held_sides):
    """Divergence from the answers of the first network for the first class at the cells `held` (b × n); 0 for equal answers.

    Of the scores, and at `held_sides` of the distributions of box sides, with the score of the first network as weight.
    """
    target = first_logits[:, 0].sigmoid()
    entropy = lambda x: F.binary_cross_entropy_with_logits(x[:, 0], target, reduction="none")
    log, first_log = sides.log_softmax(-1), first_sides.log_softmax(-1)
    side = (first_log.exp() * (first_log - log)).sum(-1).mean(2) * target
    return ((entropy(logits) - entropy(first_logits)) * held + 0.25 * side * held_sides).sum()


def batch_losses(logits, sides, found, points, strides, truth, kind, trust):
    """Sums of the three losses of a batch, and the weight to divide them by. Cells inside ignored boxes do not count.

    `trust` (b × g, 0 to 1) scales the score that a person's cells learn, and the weight of the person's box.
    """
    target = torch.zeros_like(logits)
    weight = 1 - (within(points, truth) & (kind == IGNORED)[..., None]).any(1).to(logits.dtype)
    with torch.no_grad():
        positive, which = assign(logits, found, points, strides, truth, kind)
    image, cell = positive.nonzero(as_tuple=True)
    owner = which[image, cell]
    true, trusted = truth[image, owner], trust[image, owner]
    which_class = (kind[image, owner] - PERSON).long()
    iou, giou = iou_and_giou(found[image, cell], true)
    target[image, which_class, cell] = iou.detach().clamp(0, 1) * trusted
    weight = weight.masked_fill(positive, 1.0)[:, None]
    w = logits[image, which_class, cell].detach().sigmoid().clamp(0.1) * trusted
    box = ((1 - giou) * w).sum()
    at = points[cell]
    distance = torch.cat([at - true[:, :2], true[:, 2:] - at], 1) / strides[cell][:, None]
    distance = distance.clamp(0, LARGEST_SIDE)
    low = distance.floor().long()
    high_share = distance - low
    log = sides[image, cell].log_softmax(-1)
    picked = (
        log.gather(2, low[..., None])[..., 0] * (1 - high_share)
        + log.gather(2, low[..., None] + 1)[..., 0] * high_share
    )
    side = -(picked.mean(1) * w).sum()
    score = logits.sigmoid().detach()
    entropy = F.binary_cross_entropy_with_logits(logits, target, reduction="none")
    focal = (entropy * (target - score).abs() ** 2 * weight).sum()
    return torch.stack([focal, box, side]), w.sum()
