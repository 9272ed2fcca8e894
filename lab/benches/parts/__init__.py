"""The parts of the benchmarks: each has `measure`, `tell` (Markdown) and `draw` (charts)."""
