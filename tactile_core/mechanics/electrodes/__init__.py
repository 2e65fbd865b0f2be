"""From the fluid film to the counts of the electrodes."""
