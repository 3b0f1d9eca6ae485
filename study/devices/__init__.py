"""Haptic devices behind a common safety layer.

`opening.open_device` is the only access to a device, enforced by an import contract. It finds a driver by name
(`rigs_by_name`) and returns the device behind the safety layer (`safe`), which checks requests in `admission`. `device`
is the interface that a study uses; `rig` is the interface that a driver implements: `simulated`, `force_dimension`,
`replay` (a recording). At each tick `governor` limits the force; `drive` runs the ticks, for a real device at 1 kHz in
a separate process (`loop_process`). Begin at `device.py`.
"""
