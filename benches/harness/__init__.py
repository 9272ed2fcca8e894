"""What all parts of the benchmarks share."""
