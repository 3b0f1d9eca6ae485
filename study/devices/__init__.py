"""Devices behind a common safety layer.

`opening.open_device` is the only door; an import contract keeps it so. It finds a driver by name (`rigs_by_name`),
asks for `admission`, and puts the device behind `safe`. `device` is the port that a study sees, `rig` the one that a
driver fills: a simulated device (`simulated`), Force Dimension's (`force_dimension`) and a recording (`replay`) alike.
`governor` keeps every force within its limits, `drive` runs it once a millisecond; of a real device all that is in a
process of its own (`loop_process`). Begin at `device.py`.
"""
