"""Recordings prepared for a diagnosis: checks, parts, roles of samples, and the measured motion.

In this order: `input_checks` refuses recordings that cannot be compared (`driven_response`), `observed_parts` cuts
recordings into parts at their gaps, and `observe` scales the signals by their noise and splits the samples into those
to fit, to choose and to test by. `spectral_lines` describes periodic recordings, `measured_motion` and
`motion_smoother` the motion; `correlated_residuals` holds the statistics of samples that depend on their neighbours.
"""
