"""Fault detection by comparison with reference (clean) recordings of the same device.

A base is a linear model of the device that fits recordings with and without faults. Data pass through
`recording_part` (recordings as arrays) -> `bases` (chooses `force_base`, `autoregressive_base` or `sensor_base`) ->
`mechanism_faults`, `actuator_faults` and `sensor_faults` (possible faults, each as a transformation that undoes it,
`fault`) -> `compared_base`, `joint_products` (least squares of one base on both sets, with a fault undone in one) ->
`fit_faults` (the best size of each fault) -> `rank_faults` (compares it with differences between stretches of one set;
result: `comparison`) -> `choose_fault` (names a fault or none). `likely_delays` suggests delays and clock rates by
cross-correlation; `signal_faults` finds hum, white noise and a quantized command without a base. Begin at
`rank_faults.py`.
"""
