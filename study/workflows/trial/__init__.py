"""One trial: wait for the handle, log, play the stimulus, ask, log the answer, release the force, measure, log.

`present_trial` conducts it: `ask_participant` (stimulus and answer) -> `judge_trial` (does it count) -> `trial_events`
(events, recording) -> `action_result` (how the sitting continues). `sitting` holds the ports: `display`,
`requests_port`, `session_supervisor`, `masking`. `demonstrate`, `play_probe` and `take_pause` run between trials. Used
by `study.workflows.session.run_session`; `study.tui` implements `display`. Begin at `present_trial.py`.
"""
