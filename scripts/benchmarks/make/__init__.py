"""Scripts that make files of the package: the fast tier's correction, test contacts, the print of a ball for
calibration.
"""
