"""Faults injected into recordings of real devices: real noise, known truth.

`axis_motion` (motion along a command) -> `force_injections`, `drive_injections` (they alter the recorded command);
`reading_faults` -> faults of sensor, clock and line. Begin at `injections.py`.
"""
