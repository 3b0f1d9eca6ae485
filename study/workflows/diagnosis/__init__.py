"""From recordings or a session, and a mechanical model, to a folder that names the physics that the model lacks.

Models to compare with: `fit_first_model`, `fit_without_model`, `write_twin` with `twin_calibration`. Data pass from
`diagnosis_input` (`session_references`, `join_session_trials`, `clean_recordings`) -> `diagnose_recordings` ->
`write_diagnosis` and `diagnosed_summary` -> `effect_file` (a discovered law as an effect of the user). Begin at
`diagnose_recordings.py`.
"""
