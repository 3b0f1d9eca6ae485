"""What sets recordings of a real device apart from clean ones of the same device.

`taken` makes arrays of them; `force_base`, `step_base` and `watch_base`, of which `bases` chooses, say what the device
is, faults or not;
`mechanism_faults`, `actuator_faults` and `sensor_faults` list what may have come since, each as something that can be
undone (`fault`); `stream` and `ledger` fit one base to both sets with a fault undone in one, by products of columns;
`compare` weighs all faults, against what sets stretches of one set apart, too; `decide` says what may be named. `lines`
finds hum.
"""
