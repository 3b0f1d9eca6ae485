"""Coverage of confidence intervals near the force cap: how many contain the true threshold.

`measured_coverage` (counts of simulated studies) -> `coverage_words` (sentences and a table for reports). Used by
`two_analyses`. Begin at `measured_coverage.py`.
"""
