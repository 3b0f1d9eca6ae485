"""What a TOML file may say, table by table, each number with its unit, bounds and reason.

`staircase_rule`, `apparatus`, `session_settings`, `preparation`, `participant_text` -> `study_protocol`
(`study_contradictions` across tables); `recording_segments` -> `recording_protocol`. `problem` is what is wrong with a
key. Begin at `study_protocol.py`.
"""
