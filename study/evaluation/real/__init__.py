"""Folders of real recordings: each diagnosed, faults injected under a seal, one page about all.

`real_folder` (what is there) -> `diagnose_real` -> `injected_halves`, `inject_real` -> `kept_answers` ->
`write_real`, `real_summary`. Begin at `real_recordings.py`.
"""
