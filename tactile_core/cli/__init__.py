"""The command line: ``tactile VERB``."""
