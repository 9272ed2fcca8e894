"""The losses of NanoDet: quality focal loss for scores, GIoU for boxes, distribution focal loss for sides; SimOTA assignment."""

import torch
import torch.nn.functional as F
from network import BINS

LARGEST_SIDE = BINS - 1.01
"""The largest distance from a cell to a box side, in strides, that the distribution can express."""


def pair_iou(a, b):
    """IoU of all pairs of boxes."""
    low, high = torch.max(a[:, None, :2], b[None, :, :2]), torch.min(a[:, None, 2:], b[None, :, 2:])
    inter = (high - low).clamp(0).prod(2)
    areas = [(x[:, 2:] - x[:, :2]).clamp(0).prod(1) for x in (a, b)]
    return inter / (areas[0][:, None] + areas[1][None] - inter).clamp(1e-6)


def iou_and_giou(a, b):
    """IoU and generalized IoU of boxes one by one."""
    inter = (torch.min(a[:, 2:], b[:, 2:]) - torch.max(a[:, :2], b[:, :2])).clamp(0).prod(1)
    union = (a[:, 2:] - a[:, :2]).clamp(0).prod(1) + (b[:, 2:] - b[:, :2]).prod(1) - inter
    hull = (torch.max(a[:, 2:], b[:, 2:]) - torch.min(a[:, :2], b[:, :2])).clamp(0).prod(1)
    iou = inter / union.clamp(1e-6)
    return iou, iou - (hull - union) / hull.clamp(1e-6)


def assign(logits, found, points, strides, truth):
    """SimOTA: which cells answer for which true box. Returns the positive cells and the box of each cell."""
    centre = (truth[:, :2] + truth[:, 2:]) / 2
    off = (points[None] - centre[:, None]).abs()
    inside = ((points[None] > truth[:, None, :2]) & (points[None] < truth[:, None, 2:])).all(2)
    sides = (
        torch.cat([points[None] - truth[:, None, :2], truth[:, None, 2:] - points[None]], 2) / strides[None, :, None]
    )
    allowed = inside & (off < 2.5 * strides[None, :, None]).all(2) & (sides.max(2)[0] < LARGEST_SIDE)
    for g in range(len(truth)):
        if not allowed[g].any():  # A box smaller than a cell: its nearest fine cell.
            distance = (
                ((points - centre[g]) ** 2).sum(1)
                + 1e6 * (sides[g].max(1)[0] >= LARGEST_SIDE)
                + 1e3 * (strides > strides.min())
            )
            allowed[g, distance.argmin()] = True
    iou, score = pair_iou(truth, found), logits.sigmoid()
    wrong = (
        F.binary_cross_entropy(score[None].expand_as(iou), iou.clamp(0, 1), reduction="none")
        * (iou - score[None]).abs() ** 2
    )
    cost = wrong - 3 * (iou + 1e-7).log() + 0.3 * (off / strides[None, :, None]).pow(2).sum(2).sqrt() + 1e5 * (~allowed)
    chosen = torch.zeros_like(iou, dtype=torch.bool)
    for g in range(len(truth)):
        count = int(allowed[g].sum())
        if count:
            k = int(torch.topk(iou[g] * allowed[g], min(10, count)).values.sum().clamp(1).item())
            chosen[g, cost[g].topk(min(k, count), largest=False).indices] = True
    shared = chosen.sum(0) > 1
    if shared.any():
        best = cost[:, shared].argmin(0)
        chosen[:, shared] = False
        chosen[best, shared.nonzero()[:, 0]] = True
    return chosen.any(0), chosen.float().argmax(0)


def hold_loss(logits, sides, first_logits, first_sides, points, persons):
    """Divergence from the answers of the first network at the cells within persons; 0 for equal answers.

    Of the scores, and of the distributions of box sides with the score of the first network as weight.
    """
    held = ((points[None] > persons[:, None, :2]) & (points[None] < persons[:, None, 2:])).all(2).any(0)
    target = first_logits[held].sigmoid()
    entropy = lambda x: F.binary_cross_entropy_with_logits(x[held], target, reduction="sum")
    log, first_log = sides[held].log_softmax(-1), first_sides[held].log_softmax(-1)
    side = ((first_log.exp() * (first_log - log)).sum(-1).mean(1) * target).sum()
    return entropy(logits) - entropy(first_logits) + 0.25 * side


def sample_losses(logits, sides, found, points, strides, truth, ignored):
    """Sums of the three losses of one image, and the weight to divide them by. Cells inside ignored boxes do not count."""
    target, weight = torch.zeros_like(logits), torch.ones_like(logits)
    box = side = logits.sum() * 0
    total = 0.0
    if len(ignored):
        weight[((points[None] > ignored[:, None, :2]) & (points[None] < ignored[:, None, 2:])).all(2).any(0)] = 0
    if len(truth):
        with torch.no_grad():
            positive, which = assign(logits, found, points, strides, truth)
        if positive.any():
            true = truth[which[positive]]
            iou, giou = iou_and_giou(found[positive], true)
            target[positive], weight[positive] = iou.detach().clamp(0, 1), 1.0
            w = logits[positive].detach().sigmoid().clamp(0.1)
            box, total = ((1 - giou) * w).sum(), float(w.sum())
            distance = (
                torch.cat([points[positive] - true[:, :2], true[:, 2:] - points[positive]], 1)
                / strides[positive][:, None]
            )
            distance = distance.clamp(0, LARGEST_SIDE)
            low = distance.floor().long()
            high_share = distance - low
            log = sides[positive].log_softmax(-1)
            picked = (
                log.gather(2, low[..., None])[..., 0] * (1 - high_share)
                + log.gather(2, low[..., None] + 1)[..., 0] * high_share
            )
            side = -(picked.mean(1) * w).sum()
    score = logits.sigmoid().detach()
    focal = (
        F.binary_cross_entropy_with_logits(logits, target, reduction="none") * (target - score).abs() ** 2 * weight
    ).sum()
    return torch.stack([focal, box, side]), total
