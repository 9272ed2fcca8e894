"""The parts of the benchmarks: each has `measure` and `tell` (Markdown)."""
