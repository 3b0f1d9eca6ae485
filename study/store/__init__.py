"""Files: each format read with every check and written whole.

`disk` (text, JSON, TOML, HDF5 on the disk, errors that a person can act on) -> `formats` (one file per format) ->
`sessions` (folders of sessions: log, lock, seal, live state, withdrawal). Begin at `formats/recording_file.py` and
`sessions/event_log.py`.
"""
