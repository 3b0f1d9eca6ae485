"""Export of a tracker for real-time loops in other languages: precomputed arrays, and cases to verify a translation.

`realtime_controller` (arrays of gains) -> `controller_cases` (inputs and forces to compare with). Used by
`study.workflows.equalizer.controller` (`hapteq export-controller`). Begin at `realtime_controller.py`.
"""
