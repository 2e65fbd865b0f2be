"""Scripts that make files of the package: the fast tier's correction, test contacts, the gel's rise under a ball."""
