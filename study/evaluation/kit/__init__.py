"""A laboratory's own blind test of the diagnosis, on a device that is changed on purpose.

`lab_kit` (draws and seals a table of changes) -> `score_kit` (reveals the table and scores the diagnoses). Used by
`study.cli.kit` (`hapteq kit`). Begin at `lab_kit.py`.
"""
