"""Loop that plays forces once a millisecond, and its records.

`realtime_drive` runs on the wall clock (its `Glances` are readings while nothing moves), `virtual_drive` on a simulated
one; `runner` steps a compiled device through the governor, blocks of ticks at once, `stepped_runner` one that is driven
from Python (its `Standby` is the thread that does one last thing when a driver hangs); `recorded_run` and
`last_reading` are their results. Begin at `runner.py`.
"""
