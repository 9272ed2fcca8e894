"""The Debian package in a minimal Debian, for `test_deb.py`."""
