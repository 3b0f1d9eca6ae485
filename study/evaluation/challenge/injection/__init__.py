"""Faults injected into recordings of real devices, for a blind test with real noise and known faults.

`axis_motion` (motion along a command) -> `force_injections` (faults of the mechanism), `drive_injections` (of the
drive): both alter the recorded command; `reading_faults` (of sensor, clock and mains; these alter the readings) ->
`injections` (table of all faults; injects one). Used by `study.evaluation.real.inject_real`. Begin at `injections.py`.
"""
