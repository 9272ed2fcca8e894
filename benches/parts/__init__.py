"""The parts of the benchmarks: each measures, tells (Markdown) and draws (charts)."""
