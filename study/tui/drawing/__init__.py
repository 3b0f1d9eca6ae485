"""Pictures in characters, from values to lines of text.

`braille` is the canvas, of 2 x 4 dots per character; `direction_picture`, `number_picture`, `recording_drawing` and
`staircase_drawing` draw on it. Begin at `braille.py`.
"""
