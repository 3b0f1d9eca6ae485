"""Plots and drawings of braille characters, for a terminal: from values to lines of text.

`braille` is the canvas, of 2 x 4 dots per character; `direction_picture`, `number_picture`, `recording_drawing` and
`staircase_drawing` draw on it. Used by `study.tui.widgets`, `study.tui.line_mode` and `study.cli` (`hapteq look`,
`hapteq show`). Begin at `braille.py`.
"""
