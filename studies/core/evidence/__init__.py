"""How sure a figure is: repeats of a run, intervals, digits that these support, check samples."""
