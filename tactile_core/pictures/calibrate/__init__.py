"""Calibration of a DIGIT unit: from photographs of a ball pressed anywhere to the numbers of ``calibration``.
``fit.calibrate`` fits a unit, ``evaluate.evaluate_unit`` compares a calibration with photographs."""
