"""A sitting: from a plan, through an open device and an event log, to results or a withdrawal.

`plan_sitting` -> `open_session` or `resume_session` -> `prepare_sitting` (consent, set-up) -> `run_session` (the loop)
-> `end_sitting`. `participant_*` and `other_sessions` identify the participant; `simulated_*` and `rehearse_study`
replace a person. Begin at `conduct_session.py`.
"""
