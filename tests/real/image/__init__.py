"""What `test_image.py` builds and runs images with: no container engine is needed."""
