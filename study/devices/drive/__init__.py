"""The control loop, at 1 kHz: each tick waits, senses, decides the force (`governor`), writes it, publishes telemetry.

Real device: `realtime_drive` is the thread on the wall clock, in the scheduling class of `real_time_class`;
`stepped_runner` runs its ticks, in compiled code (`compiled_ticks`, `compiled_drive`) where the driver has compiled
input and output, else from Python. Simulated device: `virtual_drive` runs the ticks that fall due in virtual time, and
`runner` steps device and governor in compiled blocks of ticks. Results: `recorded_run` (recording), `last_reading`
(present state). Used by `safe`. Begin at `runner.py`, then `compiled_drive.py`.
"""
