"""Tell units of a sensor apart: their fluid film and the gains of their electrodes."""
