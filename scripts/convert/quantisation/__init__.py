"""Quantizes converted networks to INT8: the parts of `quantise.py`, and the measurement of activation ranges.

Numbers are stored as `(integer - zero point) * scale` (Jacob et al., Quantization and Training of Neural Networks for
Efficient Integer-Arithmetic-Only Inference, 2018), weights with a scale per output channel (Krishnamoorthi,
Quantizing deep convolutional networks for efficient inference, 2018).
"""
