"""The stages of `scripts/benchmark.py`: each method is measured in a process of its own."""
