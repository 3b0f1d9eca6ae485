"""Screens of the user interface, one per file: each draws a view and turns keys into a reply, without rules of a study.

In the order of a sitting: `home`, `preparing`, `form`, `device_check`, `instructions`, `demo`, `handle`, `trial`,
`playing`, `await_return`, `practice_over`, `rest`, `pause`, `goodbye`, `outcome`. Past sessions and diagnoses:
`browse`, `session`, `diagnose_form`, `diagnosing`, `diagnosis`. Confirmations: `confirm_*`, `withdraw_prompt`. Notes
for the log: `note`, `note_prompt`. `watch_*` belong to the experimenter's view, `sensor` calibrates the accelerometer,
`help` shows the help of any screen. Used by `study.tui.app` and `study.tui.watch`. Begin at `trial.py`.
"""
