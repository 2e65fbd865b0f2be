"""Hold the package's version, below every room that writes it into a file."""

__version__ = "0.2.0"
