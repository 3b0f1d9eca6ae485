"""What was measured, made ready for a comparison.

In this order: `belonging` refuses recordings that cannot be compared (`answering`, `growth`), `command_gaps` leaves
gaps out, `observed_parts` cuts them into parts, `noise_floor` estimates the noise (`repeat_noise`, `quiet_noise`,
`rounding`), and `observed` scales the signals by it and splits the samples into those to fit, to choose and to test by.
`periods`, `detection_lines`, `frequency_cells` and `line_statistics` describe periodic recordings, `measured_motion`
and `motion_smoother` the motion.
"""
