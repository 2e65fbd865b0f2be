"""Calibration of a DIGIT unit: from photographs of a ball pressed anywhere to the numbers of ``calibration``.

``fit_unit.calibrate`` fits a unit, ``trial.try_unit`` compares a calibration with photographs.
"""
