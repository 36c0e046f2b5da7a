"""Benchmarks: `python -m benchmarks` prints medians, and ratios to peers measured in the same run."""
