"""Plays commands through a mechanical model with its effects: actuator, mechanism and hand, sensor, in this order.

`command_path` -> `bodies` (which masses, which forces) -> `stepping` (`mechanism_kernel`, `linear_step_kernel`, in the
coordinates of `modal_form`) -> `sensor_path`, `interpolated_response`. `along_motion` gives forces along a measured
motion instead. `*_kernel` files are compiled; each holds what it calls, or imports other kernels. Begin at
`simulator.py`.
"""
