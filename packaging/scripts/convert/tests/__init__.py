"""Tests of the converters; they need the packages that the converters import, and no network."""
