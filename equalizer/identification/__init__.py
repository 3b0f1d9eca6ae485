"""System identification: from recordings to models of the device.

`frequency_response`: nonparametric estimates with their noise variance, from recordings. `state_space`: A, B, C, D,
fitted to such an estimate by subspace identification and maximum likelihood. `mechanical`: masses, dampers and springs,
fitted to the spectra of recordings directly. Used by `study.workflows.equalizer` and `analysis.diagnosis`. Begin at
`state_space/identify_recordings.py` or `mechanical/mechanical_fit.py`.
"""
