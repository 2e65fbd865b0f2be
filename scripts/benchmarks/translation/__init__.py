"""How good a translation is: against recordings of real sensors, with the figures of doing nothing beside it."""
