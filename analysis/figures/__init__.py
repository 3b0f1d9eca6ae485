"""Figures: functions from values to Matplotlib figures. No file is written here.

A file named `…_pictures` collects all figures of one report, in the order of the report (`study_pictures`,
`look_pictures`, `blind_test_pictures`, `reproduction_pictures`; `diagnosis/` holds those of a diagnosis); each other
file draws one figure. All use the colours and axes of `style`. A `picture` is a figure with its title, its caption and
its text for screen readers. Used by `analysis.reports` and `study`. Begin at `picture.py`, then a `…_pictures` file.
"""
