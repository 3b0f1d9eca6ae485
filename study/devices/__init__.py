"""Devices behind one safety layer. `opening.open_device` is the only door; an import contract keeps it so."""
