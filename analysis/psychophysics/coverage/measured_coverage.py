"""Measured coverage near the force cap: how many intervals of a report contain the true value.

Each row: analysis (`coverage_words.INTERVAL_TITLES`), frequency (Hz; 0 where all frequencies are judged together), mean
error (dB; None where the analysis gives no size in dB), 95 % intervals that contain the true value (one-way: studies
with a significant difference although there is none), and all intervals (studies).

Counted in simulated studies of ten people ("single": of one) with known thresholds under the published staircase and
cap (one-way: thresholds of equal median). Tobit gives no interval where all runs of a frequency are censored. Written
by `make coverage` (tests/references/coverage_of_analyses.py), never by hand; docs/statistics.md has the same table.
"""

from analysis.psychophysics.coverage.coverage_words import MeasuredCoverage

MEASURED_COVERAGES = (
    MeasuredCoverage("means", 25.0, -0.5, 366, 400),
    MeasuredCoverage("means", 35.0, -3.3, 75, 400),
    MeasuredCoverage("means", 45.0, -5.07, 6, 400),
    MeasuredCoverage("model", 25.0, -0.05, 384, 400),
    MeasuredCoverage("model", 35.0, -0.06, 382, 400),
    MeasuredCoverage("model", 45.0, -0.08, 371, 400),
    MeasuredCoverage("one-way", 0.0, None, 4, 400),
    MeasuredCoverage("run", 25.0, -0.16, 3669, 4000),
    MeasuredCoverage("run", 35.0, -1.03, 3731, 4000),
    MeasuredCoverage("run", 45.0, -1.75, 3807, 4000),
    MeasuredCoverage("single", 25.0, -0.21, 373, 400),
    MeasuredCoverage("single", 35.0, -0.94, 381, 400),
    MeasuredCoverage("single", 45.0, -1.98, 379, 400),
    MeasuredCoverage("tobit", 25.0, -0.49, 376, 400),
    MeasuredCoverage("tobit", 35.0, -1.04, 338, 394),
    MeasuredCoverage("tobit", 45.0, -1.7, 260, 319),
    MeasuredCoverage("tukey", 25.0, None, 400, 400),
    MeasuredCoverage("tukey", 35.0, None, 0, 400),
    MeasuredCoverage("tukey", 45.0, None, 0, 400),
)
