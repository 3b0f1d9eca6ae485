"""Evaluation of the diagnosis and the equalizer: blind tests on simulated and real recordings, and published figures.

`challenge` (simulated devices with concealed faults; does not use the diagnosis) -> `bank` (seal, diagnose, reveal,
score: `hapteq prove`); `real` (folders of recordings, with faults injected under a seal: `hapteq real`). Independent of
these: `kit` (a laboratory's own blind test: `hapteq kit`) and `reproduction` (published figures: `hapteq reproduce`).
Used by `study.cli`. Begin at `bank/prove.py`.
"""
