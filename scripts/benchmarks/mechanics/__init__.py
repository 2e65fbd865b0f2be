"""Contact mechanics held against known answers: one file per check, each a generator of report rows."""
