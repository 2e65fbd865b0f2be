"""Contact mechanics of the two fingertips: solids, compliance, contact, fluid, electrodes, paired contacts."""
