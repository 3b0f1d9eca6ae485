"""Data classes that screens, text lines and lists display: plain values, quick to import.

The values for a participant contain no level, frequency or correctness of answers. `participant_views` (the
participant's display); `form_views` (structure of a form) -> `forms` (made from a protocol) -> `form_entry` (while it
is filled in); `archive_views` (past sessions); `handle_notice` (notices before a device moves). Formatting of text:
`local_time`, `printable`, `count_text`, `participant_codes`, `resume_command`. Used by `study.tui`, which displays
them, and `study.workflows`, which makes them. Begin at `participant_views.py`.
"""
