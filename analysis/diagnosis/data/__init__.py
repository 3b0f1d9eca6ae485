"""Recordings prepared for a diagnosis: checks, parts, roles of samples, and the measured motion.

In this order: `input_checks` refuses recordings that cannot be compared (`driven_response`, `growth_rate`),
`observed_parts` cuts recordings into parts at their gaps, and `observe` scales the signals by their noise and splits
the samples into those to fit, to choose and to test by. `detection_lines`, `frequency_cells` and `line_statistics`
describe periodic recordings, `measured_motion` and `motion_smoother` the motion.
"""
