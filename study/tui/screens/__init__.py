"""Whole screens: each turns a view into cells and keys into a reply, without rules. One screen a file.

In the order of a sitting: `home`, `preparing`, `form`, `device_check`, `instructions`, `demo`, `handle`, `trial`,
`playing`, `await_return`, `practice_over`, `rest`, `pause`, `goodbye`, `outcome`. Of past sessions and diagnoses:
`browse`, `session`, `diagnose_form`, `diagnosing`, `diagnosis`. Questions before something final: `confirm_*`,
`withdraw_prompt`. `note` and `note_prompt` write to the log, `watch_*` belongs to the experimenter's view, `sensor` to
the accelerometer. Begin at `trial.py`.
"""
