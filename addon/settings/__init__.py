"""What is set in a .blend and in the preferences, and how errors are reported."""
