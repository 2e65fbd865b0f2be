"""What measures, and what makes the data that ships; no part of the package. Scripts here are run by their path."""
