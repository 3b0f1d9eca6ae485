"""Schemas of protocol files (TOML), table by table: each field with its unit, bounds and the reason for its default.

Tables: `staircase_rule`, `apparatus`, `session_settings`, `preparation`, `participant_text`, `measurement`, `probes`,
`declared_analysis` -> `study_protocol` (`study_contradictions`: checks across tables); `recording_segments` ->
`recording_protocol`. `field_types` are shared types, `plausibility` the bounds of position readings, `problem` a
validation problem of one key. `new_use` lists what is refused in protocol files only, not in logs. Used by `document`,
`procedure`, `study` and `analysis.psychophysics`. Begin at `study_protocol.py`.
"""
