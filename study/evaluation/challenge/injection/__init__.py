"""Faults put into recordings of real devices: real noise, known truth.

`moved_axis` (the motion along a command) -> `force_injections`, `drive_injections` (by way of the recorded command);
`spoiled_readings` -> faults of sensor, clock and line. Begin at `injections.py`.
"""
