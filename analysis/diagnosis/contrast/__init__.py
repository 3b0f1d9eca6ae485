"""Fault detection by comparison with reference (clean) recordings of the same device.

A base is a linear model of the device that is fitted to recordings with and without faults. Data pass through
`recording_part` (recordings as arrays) -> `bases` (builds `force_base` or `autoregressive_base`; for sensors,
`sensor_base`) -> `mechanism_faults`, `actuator_faults`, `sensor_faults` (possible faults, each as a transformation that
undoes it: `fault`, `interpolation`) -> `compared_base`, `joint_products` (least squares of one base on both sets) ->
`fit_faults` (size of each fault; delays and clock rates start at `likely_delays`) -> `rank_faults` (gain of each fault
compared with differences within one set; result: `comparison`) -> `choose_fault` (names a fault or none).
`signal_faults` finds hum, white noise and a quantized command without a base. Used by
`reference.compare_with_reference`. Begin at `rank_faults.py`.
"""
