"""Our file formats, one a file: layout, reading and writing. All fields: docs/formats.md.

Recordings and models: `recording_file` (fields in `recording_layout`), `mechanical_model_file`,
`identified_model_file`, `calibration_file`, `trajectory_file`. Protocols: `protocol_files`, `participant_texts`.
Results: `trials_file`, `thresholds_file`, `diagnosis_file`, `repeats_file`, `daily_check_file`, `real_answer_file`,
`reproduction_file`. Exports for others: `tidy_csv`, `psych_ds`, `bids_behaviour`, `trials_mat`, with the columns of
`trial_columns` and the answers of `answer_table`. Begin at `recording_file.py`.
"""
