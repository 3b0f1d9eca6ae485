"""Counted by `make coverage` (tests/references/coverage_of_analyses.py), not written by hand."""

from analysis.psychophysics.coverage.coverage_words import MeasuredCoverage

MEASURED = (
    MeasuredCoverage("means", 25.0, -0.75, 4, 4),
    MeasuredCoverage("means", 35.0, -2.74, 0, 4),
    MeasuredCoverage("means", 45.0, -4.83, 0, 4),
    MeasuredCoverage("model", 25.0, -0.22, 4, 4),
    MeasuredCoverage("model", 35.0, 0.49, 4, 4),
    MeasuredCoverage("model", 45.0, -0.72, 4, 4),
    MeasuredCoverage("one-way", 0.0, None, 0, 4),
    MeasuredCoverage("run", 25.0, -0.01, 38, 40),
    MeasuredCoverage("run", 35.0, -0.47, 39, 40),
    MeasuredCoverage("run", 45.0, -2.55, 36, 40),
    MeasuredCoverage("single", 25.0, 0.42, 4, 4),
    MeasuredCoverage("single", 35.0, -0.99, 4, 4),
    MeasuredCoverage("single", 45.0, -0.0, 4, 4),
    MeasuredCoverage("tobit", 25.0, -0.47, 3, 3),
    MeasuredCoverage("tobit", 35.0, -0.58, 3, 3),
    MeasuredCoverage("tobit", 45.0, -2.59, 3, 3),
    MeasuredCoverage("tukey", 25.0, None, 4, 4),
    MeasuredCoverage("tukey", 35.0, None, 0, 4),
    MeasuredCoverage("tukey", 45.0, None, 0, 4),
)
