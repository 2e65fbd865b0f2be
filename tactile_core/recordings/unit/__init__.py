"""The properties of a unit of a sensor: its fluid film and the gains of its electrodes."""
