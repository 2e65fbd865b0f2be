"""Contact mechanics compared with known answers: one file per check, each a generator of report rows."""
