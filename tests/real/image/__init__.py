"""Builds and runs images for `test_image.py`, without a container engine."""
