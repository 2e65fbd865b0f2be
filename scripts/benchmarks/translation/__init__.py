"""Measure the quality of a translation, on simulated contacts and on recordings of real sensors, beside baselines."""
