"""The loop that plays forces once a millisecond, and what it saw.

`realtime_drive` runs on the wall clock, `virtual_drive` on a simulated one; `runner` and `stepped_runner` step the
device through the governor, `block` a block of ticks at once; `standby` holds between trials; `played`, `seen` and
`glances` are what they hand out. Begin at `runner.py`.
"""
