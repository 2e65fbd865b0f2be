"""Make simulated recordings, and paired contacts of both sensors, from scenes."""
