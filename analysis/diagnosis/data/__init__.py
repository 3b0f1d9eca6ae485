"""Recordings prepared for a diagnosis: checks, parts, roles of samples, and the measured motion.

Data pass through `find_segments` (periodic segments), `force_constant` (commands as forces) -> `input_checks` (refuses
recordings that cannot be compared; `driven_response`) -> `observed_parts` (cuts recordings into parts at their gaps) ->
`observed` (splits the samples into those to fit, to choose and to test by). `measured_motion` and `motion_smoother`
estimate the motion, `spectral_lines` the lines of periodic recordings, `closed_loop` whether a controller acts,
`readings_at_limit` whether a sensor is clipped; `recorded_conditions` adapts the model to the conditions of a
recording, `correlated_residuals` holds statistics of correlated samples. Used by all later steps of the diagnosis.
Begin at `observed_parts.py`.
"""
