"""Detection thresholds of simulated participants: whether a vibration is felt, regardless of its direction. All numbers
are assumptions of the authors.

Detecting a vibration needs a much lower level than identifying its direction, and this level rises less from 5 to 45
Hz: a participant who does not feel the direction still feels the vibration.
"""

TYPICAL_DETECTION_N = ((5.0, 0.08), (15.0, 0.08), (25.0, 0.1), (35.0, 0.12), (45.0, 0.14))
"""(frequency in Hz, level in N at which the median participant finds the interval of the vibration in 79.37 % of the
trials), frequencies ascending."""

DETECTION_SLOPE = 2.5
"""Slope (exponent) of the Weibull function of force, without unit; slightly steeper than for directions."""
