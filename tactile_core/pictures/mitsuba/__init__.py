"""Pictures whose rays Mitsuba casts."""
