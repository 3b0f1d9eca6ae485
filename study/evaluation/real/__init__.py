"""Folders of real recordings: diagnose each, inject faults under a seal, write a page about all.

`real_folder` (inventory) -> `diagnose_real` -> `injected_halves`, `inject_real` -> `reuse_answers` -> `write_real`,
`real_summary`. Begin at `real_recordings.py`.
"""
