"""Comparison of the five published figures with their reproduction on a simulated device: findings, judged by rules.

`measured_device` (response over the whole range) -> `response_findings` (figures 4 and 1); `study_findings` is for
figure 2, `ellipsoid_findings` for figure 3; `played_response` -> `equalized_findings` (figure 5). All return the types
of `document`, the content of `reproduction.json`. The publication is Wilson, Chan, Salisbury and Niemeyer, Multi-DOF
Equalization of Haptic Devices. Used by `study.evaluation.reproduction`. Begin at `study_findings.py`.
"""
