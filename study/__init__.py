"""Doing it: the only package with side effects. Sessions, devices, files, people, screens.

Layers, each knowing only those after it: `cli`, `tui`, `workflows`, then `devices`, `store` and `participants`
beside each other, then `session`, which is pure, then `errors`.

Read in this order: `session.events` (the facts), `session.state` (their fold), `session.machine` (what is next),
`workflows.run_session` and `workflows.present_trial` (doing it), `devices.device` (the port) and `devices.govern`
(what keeps the force within its limits), `store.event_log` (on the disk before anybody acts on it).

Decisions:

2026-11-21. The staircase moves when a trial is closed by its measurement, not at the answer: a trial that the device
spoiled must be void although it was answered. An answer whose measurement was lost in a crash counts.
2026-11-21. A display may know nothing about level, frequency or correctness: its views have no field for them.
2026-11-21. A simulated participant is told what it feels through the port `Hand`; a person's hand needs no telling.
"""
