"""Files: each format is checked completely when it is read, and written atomically.

In the order of dependence: `disk` (text, CSV, JSON, TOML and HDF5 on the disk; errors with advice) -> `formats` (the
file formats of hapteq, one module each) -> `sessions` (folders of sessions: log, lock, seal, live state, withdrawal).
Used by `study.workflows`, `study.evaluation`, `study.importing` and `study.cli`. Begin at `formats/recording_file.py`
and `sessions/event_log.py`.
"""
