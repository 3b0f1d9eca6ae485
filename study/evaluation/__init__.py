"""Evaluation of the diagnosis and the equalizer: blind tests on simulated and real recordings, and published figures.

`challenge` (simulated devices with concealed faults; does not use the diagnosis) -> `bank` (seal, diagnose, reveal,
score: `hapteq prove`); `real` (folders of recordings, with faults injected under a seal: `hapteq real`); `kit` (a
laboratory's own blind test) and `reproduction` (the published figures) are independent. Begin at `bank/prove.py`.
"""
