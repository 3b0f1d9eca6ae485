"""Haptic devices behind a common safety layer.

An import contract gives other packages access only to `opening` (opens devices), `device` (the interface that a study
uses) and `clock`. `opening` finds a driver by name (`rigs_by_name`) and returns the device behind the safety layer
(`safe`; `admission` checks its requests). `rig` is the interface that a driver implements: `simulated`,
`force_dimension` (with an `accelerometer`), `replay` (a recording). At each tick `governor` limits the force; `drive`
runs the ticks (`native`: C calls), for a real device at 1 kHz in a separate process (`loop_process`); `telemetry`
publishes them. `masking_sound` and `onset_line` are further outputs. Used by `study.workflows`, `study.tui` and
`study.evaluation`. Begin at `device.py`.
"""
