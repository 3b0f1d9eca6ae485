"""A sitting of a participant: from its plan, through an open device and an event log, to results or a withdrawal.

`plan_sitting` -> `equalize_stimuli` (model) -> `open_session` or `resume_session` -> `prepare_sitting` (consent,
set-up) -> `run_session` (loop over trials) -> `session_end` (interruptions, errors) -> `end_sitting` (results, or
`withdraw_participant`). `participant_*` and `other_session_dose` read a participant's other sessions; `simulated_*`,
`stimulus_sampler`, `simulate_session` and `rehearse_study` replace the person; `write_masking_noise` is `hapteq noise`.
Used by `study.cli` and `study.tui.engine`. Begin at `conduct_session.py`.
"""
