"""The loop that plays forces once a millisecond, and its records. A tick: wait, sense, govern, write, publish
telemetry.

Of a real device `realtime_drive` is the thread on the wall clock, in the scheduling class of `real_time_class`; where
the driver has compiled halves, `compiled_drive` runs its ticks (`compiled_ticks` hands it the arrays), else
`stepped_runner` from Python. Of a simulated one `virtual_drive` is the clock, and `runner` steps device and governor in
blocks of ticks. `recorded_run` and `last_reading` are what comes out. Begin at `runner.py`, then `compiled_drive.py`.
"""
