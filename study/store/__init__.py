"""Files: each format is read with all checks and written atomically.

`disk` (text, JSON, TOML, HDF5 on the disk, actionable errors) -> `formats` (one file per format) -> `sessions` (folders
of sessions: log, lock, seal, live state, withdrawal). Begin at `formats/recording_file.py` and `sessions/event_log.py`.
"""
