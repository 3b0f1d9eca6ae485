"""At which level a vibration is felt at all, whatever its direction. All numbers are ours.

Feeling that something shakes takes far less than feeling along which line, and hardly more at 45 Hz than at 5 Hz:
where the direction is lost, the vibration is not.
"""

TYPICAL_DETECTION_N = ((5.0, 0.08), (15.0, 0.08), (25.0, 0.1), (35.0, 0.12), (45.0, 0.14))
"""(Hz, N): the median participant finds the interval 79.37 % of the time."""

DETECTION_SLOPE = 2.5
"""Of the Weibull curve over newtons. Detection is a little steeper than telling directions."""
