"""From recordings or a session, and a model, to a folder that names the physics that the model lacks.

`fit_first_model`, `write_twin` (a model to compare with) -> `diagnosis_input`, `session_as_recordings` ->
`diagnose_recordings` -> `write_diagnosis` -> `effect_file` (a discovered law as a user's own effect). Begin at
`diagnose_recordings.py`.
"""
