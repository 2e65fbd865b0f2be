"""Scripts that make tables and weights that ship: the fast tier's correction, the test contacts, the print of a
ball.
"""
