"""Simulates a mechanical model with its effects under commands: actuator, mechanism and hand, sensor, in this order.

`simulator` calls `command_path` -> `bodies` (masses, forces) -> `stepping` (`mechanism_kernel`, `linear_step_kernel`,
in the coordinates of `modal_form`; `instant` is the layout of its arrays) -> `sensor_path`, `interpolated_response`.
`forces_along_motion` computes the effects' forces along a measured motion instead. Files `*_kernel` are compiled by
numba and call only compiled functions. Used by `equalizer.effects` and `analysis.diagnosis`. Begin at `simulator.py`.
"""
