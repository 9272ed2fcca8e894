"""Tests of the assignment of cells to persons and of the losses, on cells and boxes placed by hand."""

import unittest

try:
    import torch
except ModuleNotFoundError:
    torch = None

if torch:
    from losses import ABSENT, IGNORED, PERSON, assign, batch_losses, hold_loss
    from network import BINS

    POINTS = torch.stack(torch.meshgrid(torch.arange(8), torch.arange(8), indexing="xy"), -1).reshape(-1, 2) * 8.0 + 4
    STRIDES = torch.full((64,), 8.0)


def losses(logit, truth, kind, trust):
    """The losses of one image of 64 × 64 pixels whose cells all have the score of `logit` and boxes of 16 × 16 pixels."""
    logits, sides = torch.full((1, 1, 64), logit), torch.zeros(1, 64, 4, BINS)
    found = torch.cat([POINTS - 8, POINTS + 8], 1)[None]
    arguments = (torch.tensor([truth]), torch.tensor([kind]), torch.tensor([trust]))
    return batch_losses(logits, sides, found, POINTS, STRIDES, *arguments)


@unittest.skipUnless(torch, "needs lab/training/requirements-train.txt")
class Losses(unittest.TestCase):
    def test_each_person_has_cells_of_its_own(self):
        truth = torch.tensor([[[0.0, 0, 16, 16], [32, 32, 48, 48], [0, 0, 0, 0]]])
        kind = torch.tensor([[PERSON, PERSON, ABSENT]])
        found = torch.cat([POINTS - 8, POINTS + 8], 1)[None]
        positive, which = assign(torch.zeros(1, 1, 64), found, POINTS, STRIDES, truth, kind)
        cells = {n: POINTS[positive[0] & (which[0] == n)] for n in range(3)}
        self.assertTrue(len(cells[0]) and (cells[0] < 16).all())
        self.assertTrue(len(cells[1]) and ((cells[1] > 32) & (cells[1] < 48)).all())
        self.assertEqual(len(cells[2]), 0)

    def test_person_smaller_than_a_cell_has_the_nearest_cell(self):
        truth, kind = torch.tensor([[[17.0, 17, 19, 19]]]), torch.tensor([[PERSON]])
        found = torch.cat([POINTS - 8, POINTS + 8], 1)[None]
        positive, _ = assign(torch.zeros(1, 1, 64), found, POINTS, STRIDES, truth, kind)
        self.assertEqual(POINTS[positive[0]].tolist(), [[20.0, 20.0]])

    def test_cells_in_ignored_boxes_cost_nothing(self):
        whole = [[0.0, 0, 64, 64]]
        self.assertEqual(float(losses(3.0, whole, [IGNORED], [1.0])[0][0]), 0)
        self.assertGreater(float(losses(3.0, whole, [ABSENT], [1.0])[0][0]), 1)

    def test_untrusted_person_teaches_a_low_score(self):
        person = [[8.0, 8, 24, 24]]
        sure = lambda trust: float(losses(-4.0, person, [PERSON], [trust])[0][0])
        self.assertGreater(sure(1.0), 5 * sure(0.2))

    def test_a_person_teaches_the_score_of_its_class(self):
        logits = torch.zeros(1, 2, 64, requires_grad=True)
        found = torch.cat([POINTS - 8, POINTS + 8], 1)[None]
        truth, kind, trust = torch.tensor([[[4.0, 4, 20, 20]]]), torch.tensor([[PERSON + 1]]), torch.ones(1, 1)
        batch_losses(logits, torch.zeros(1, 64, 4, BINS), found, POINTS, STRIDES, truth, kind, trust)[0][0].backward()
        self.assertGreater(float(logits.grad[0, 0].min()), 0)
        self.assertLess(float(logits.grad[0, 1].min()), 0)

    def test_equal_answers_hold_without_loss(self):
        logits, sides = torch.randn(1, 1, 64), torch.randn(1, 64, 4, BINS)
        held = torch.ones(1, 64, dtype=torch.bool)
        self.assertAlmostEqual(float(hold_loss(logits, sides, logits, sides, held, held)), 0, places=4)
        self.assertGreater(float(hold_loss(logits + 1, sides, logits, sides, held, held)), 1)


if __name__ == "__main__":
    unittest.main()
