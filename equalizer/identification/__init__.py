"""System identification: from recordings to models of the device.

`frequency_response` (recordings -> measured lines with their errors) -> `state_space` (lines -> A, B, C, D by
subspace identification and maximum likelihood) or `mechanical` (lines -> masses, dampers, springs). Begin at
`state_space/identify_recordings.py` or `mechanical/mechanical_fit.py`.
"""
