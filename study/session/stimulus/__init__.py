"""Forces that a device has to play, the limits for them, and the acceleration that was delivered.

Order of the data in a trial: level -> `stimulus` (one loop of whole periods) -> `held_stimulus` (the form that a device
plays) -> `delivered` (amplitudes from the recording). `probe_stimulus` computes the forces of probes,
`recording_pieces` those of recordings; `limits` holds the safety limits, `timing_verdict` the timing requirements. Used
by `study.workflows` and `study.devices`. Begin at `stimulus.py`.
"""
