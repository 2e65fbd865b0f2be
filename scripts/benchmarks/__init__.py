"""Benchmarks, and scripts that make the data that ships; no part of the package. Scripts here are run by their path."""
