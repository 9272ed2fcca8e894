"""Makes INT8 networks of converted ones: the parts of `quantise.py`, and how activation ranges are measured.

Numbers are stored as `(integer - zero point) * scale` (Jacob et al., Quantization and Training of Neural Networks for
Efficient Integer-Arithmetic-Only Inference, 2018), weights with a scale per output channel (Krishnamoorthi,
Quantizing deep convolutional networks for efficient inference, 2018).
"""
