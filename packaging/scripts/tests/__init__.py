"""Tests of the set-up; they need no network and nothing but Python's standard library."""
