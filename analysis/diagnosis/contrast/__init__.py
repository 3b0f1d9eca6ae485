"""Fault detection against reference recordings: what sets recordings apart from clean ones of the same device.

`part` makes arrays of them; `force_base`, `autoregressive_base` and `sensor_base`, of which `bases` chooses, say what
the device is, faults or not; `mechanism_faults`, `actuator_faults` and `sensor_faults` list what may have come since,
each as something that can be undone (`fault`); `stream` and `joint_products` fit one base to both sets with a fault
undone in one, by products of columns; `likely_delays` suggests delays and clock rates by cross-correlation;
`try_faults` finds each fault's best size; `compare` judges it, against what sets stretches of one set apart, too;
`comparison` holds what it found; `decide` says what may be named. `signal_faults` finds hum, white noise and a
quantized command.
"""
