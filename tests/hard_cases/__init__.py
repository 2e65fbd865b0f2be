"""Hard cases: what is asked, of which stage, and what is expected; ``benchmarks/hard_cases.py`` prints them all."""
