"""Benchmarks, and scripts that make files of the package. They are no part of the package and are run by their path."""
