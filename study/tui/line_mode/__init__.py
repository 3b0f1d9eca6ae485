"""Line mode: the participant's part in plain sentences, for any terminal, a screen reader, or piped answers.

`line_input` -> `conversation` (sentences out, lines in) -> `plain_forms`, `plain_demo`, `plain_question`, `plain_pause`
-> `plain_display`, which implements the display. Used by `study.cli.conduct`. Begin at `plain_display.py`.
"""
