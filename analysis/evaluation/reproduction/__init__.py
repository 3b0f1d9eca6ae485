"""Comparison of the published figures with their reproduction: findings, judged by stated rules.

`measured_device` (sweeps over the whole range) -> `response_findings` (figures 4 and 1), `study_findings` (figure 2),
`ellipsoid_findings` (figure 3), `played_response` -> `equalized_findings` (figure 5) -> `document`, the form in
which all of them answer. Begin at `study_findings.py`.
"""
