"""Settings in a .blend and in the preferences, and reports of errors."""
