"""The facts of a session, one JSON line each, and what their fields mean.

`fact_types` (kinds of values) -> `sitting_events`, `answer_given`, `level_scale` -> `events` (all of them);
`log_chain` and `log_time` are their checksum and their time, `event_words` says them in sentences. Begin at
`events.py`.
"""
