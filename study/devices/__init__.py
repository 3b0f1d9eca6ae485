"""Devices behind one safety layer.

`opening.open_device` is the only door; an import contract keeps it so. It finds a driver by name (`rigs_by_name`),
asks for `admission`, and puts the device behind `safe`. `device` is the port that a study sees, `rig` the one that a
driver fills: a simulated device (`simulated`) and Force Dimension's (`force_dimension`) alike. `governor` keeps every
force within its limits, `drive` runs it once a millisecond. Begin at `device.py`.
"""
