"""Detection thresholds of simulated participants: at which level a vibration is felt, regardless of its direction.

All numbers are assumptions of the authors. The threshold for detecting a vibration is much lower than that for
identifying its direction, and rises less from 5 to 45 Hz: a participant who does not feel the direction still feels the
vibration.
"""

TYPICAL_DETECTION_N = ((5.0, 0.08), (15.0, 0.08), (25.0, 0.1), (35.0, 0.12), (45.0, 0.14))
"""Thresholds of the median participant: (frequency in Hz, level in N at which the interval of the vibration is found in
79.37 % of the trials, the target 0.5^(1/3) of a 3-down 1-up staircase), frequencies ascending."""

DETECTION_SLOPE = 2.5
"""Slope (exponent) of the Weibull function of force, without unit; slightly steeper than for directions (2)."""
