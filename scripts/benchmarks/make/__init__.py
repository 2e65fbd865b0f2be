"""What makes tables and weights that ship: the correction of the fast tier, the test contacts, the print of a ball."""
