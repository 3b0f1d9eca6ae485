"""Recordings: made on a device, imported from files of other programs, and inspected before any model.

A recording protocol -> `play_pieces` (play each excitation) -> `recording_metadata` (metadata, warnings) -> one HDF5
file, all conducted by `record_device`; `import_recording` makes the same file from foreign files, and
`read_any_recording` reads either kind; `look_at_recordings` inspects them. `calibrate_linkage` records a device's
linkage over the workspace. Used by `study.cli` and `study.workflows.diagnosis`. Begin at `record_device.py`.
"""
