"""Fault detection by comparison with reference (clean) recordings of the same device.

`part` makes arrays of them; `force_base`, `autoregressive_base` and `sensor_base`, of which `bases` chooses, are base
models of the device, with or without faults; `mechanism_faults`, `actuator_faults` and `sensor_faults` list possible
faults, each as a transformation that undoes it (`fault`); `compared_base` and `joint_products` fit one base to both
sets with a fault undone in one, by products of columns; `likely_delays` suggests delays and clock rates by
cross-correlation; `try_faults` finds each fault's best size; `compare` judges it against differences between stretches
of one set; `comparison` holds what it found; `decide` says what may be named. `signal_faults` finds hum, white noise
and a quantized command.
"""
