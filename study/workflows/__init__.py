"""Use cases: plain functions over ports, from a whole sitting to the validation of one file.

Folders, in the order in which data pass: `checks` (is the set-up fit) -> `recording` (play and import recordings) ->
`equalizer` (models, forces) -> `trial` (one stimulus and its answer) -> `results` (what a session log amounts to) ->
`session` (a sitting from opening to end) -> `views` (read only) -> `diagnosis` -> `files` (what any file is). Modules
beside the folders are used by several of them (free file names, pictures, worker processes). Begin at
`session/conduct_session.py`, `equalizer/identify_model.py` or `diagnosis/diagnose_recordings.py`.
"""
