"""Measure the quality of a translation: against recordings of real sensors, beside the baseline."""
