"""File formats of hapteq, a module for each: layout, reading and writing. docs/formats.md lists all fields.

Recordings and models: `recording_file` (fields in `recording_layout`), `mechanical_model_file`,
`identified_model_file`, `calibration_file`, `trajectory_file`. Protocols: `protocol_files`, `participant_texts`.
Results: `trials_file`, `thresholds_file`, `diagnosis_file`, `repeats_file`, `daily_check_file`, `real_answer_file`,
`reproduction_file`. Exports for other programs: `tidy_csv`, `psych_ds`, `bids_behaviour`, `trials_mat`, with the
columns of `trial_columns` and the answers of `answer_table`. Used by `study.workflows` and `study.evaluation`. Begin at
`recording_file.py`.
"""
