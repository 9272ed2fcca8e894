"""Code that all parts of the benchmarks share."""
