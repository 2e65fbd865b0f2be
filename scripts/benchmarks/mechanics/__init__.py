"""Contact mechanics held against known answers: one file a check, each a generator of report rows."""
