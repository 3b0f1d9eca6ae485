"""Logged events of a session (facts), one JSON line each in events.jsonl, and the meaning of their fields.

`fact_types` (types of values) -> `sitting_events`, `sensor_facts`, `answer_given`, `level_scale` -> `events` (the union
of all facts). `log_chain` is the checksum of the lines, `log_time` the elapsed time, `void_reasons` the reasons for
void trials, and `event_words` describes each fact in a sentence. Used by `study.session.state`, `study.store.sessions`
and `study.workflows`. Begin at `events.py`.
"""
