"""One trial at the handle: wait, log, play, ask, log, release, measure, log.

`sitting` holds the ports (`display`, `requests_port`, `session_supervisor`) -> `await_handle` -> `ask_participant` ->
`trial_facts` -> `judge_trial`; `demonstrate` and `take_pause` run between trials. Begin at `present_trial.py`.
"""
