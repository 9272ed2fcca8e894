"""Reads detectors of the darknet framework: a `.cfg` file that describes the network and a `.weights` file.

The YOLOv2 and YOLOv3 families, their tiny ones too: Redmon and Farhadi, YOLO9000: Better, Faster, Stronger, 2017,
and YOLOv3: An Incremental Improvement, 2018.
"""
