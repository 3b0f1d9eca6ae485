"""Detection thresholds of simulated participants: whether a vibration is felt, regardless of its direction. All numbers
are assumptions of the authors.

Detecting a vibration takes a much lower level than telling its direction, and hardly rises from 5 to 45 Hz: where the
direction is not felt, the vibration still is.
"""

TYPICAL_DETECTION_N = ((5.0, 0.08), (15.0, 0.08), (25.0, 0.1), (35.0, 0.12), (45.0, 0.14))
"""(Hz, N): the median participant finds the interval 79.37 % of the time."""

DETECTION_SLOPE = 2.5
"""Slope of the Weibull curve over newtons; slightly steeper than for directions."""
