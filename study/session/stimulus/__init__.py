"""The stimulus that a device has to play, its limits, and what was delivered.

A level -> `stimulus` (one loop of whole periods) -> `held_stimulus` (the device's part of it) -> `delivered`.
`recording_pieces` is the same for recordings; `limits` and `timing_verdict` say what is allowed. Begin at
`stimulus.py`.
"""
