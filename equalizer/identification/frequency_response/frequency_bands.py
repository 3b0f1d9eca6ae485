"""Division of a haptic device's frequency range into three bands, with the control method that suits each.

After figure 1 of Wilson, Chan, Salisbury and Niemeyer, Multi-DOF Equalization of Haptic Devices. Two frequencies divide
the range: the onset of coupling, above which a force along one axis also moves others, and the limit of direction
perception, above which people hardly perceive the direction of a vibration. Called by the reports of identification
and of the reproduction of that paper, and drawn by `analysis.figures.frequency_bands`.
"""

from dataclasses import dataclass

PUBLISHED_DIRECTION_LIMIT_HZ = 35.0
"""Highest frequency (Hz) at which people distinguished directions on an omega.3; from the paper above."""


@dataclass(frozen=True, slots=True)
class FrequencyBand:
    """A frequency band, the control method that suits it, and the reason for that method."""

    name: str
    """"low", "middle" or "high"."""
    low_hz: float
    high_hz: float
    method: str
    """Control method, as a phrase for reports."""
    reason: str
    """Reason for the method, as a sentence."""


def compute_frequency_bands(
    coupling_onset_hz: float | None,
    direction_limit_hz: float = PUBLISHED_DIRECTION_LIMIT_HZ,
    lowest_hz: float = 1.0,
    highest_hz: float = 500.0,
) -> tuple[FrequencyBand, ...]:
    """Divide the range from lowest_hz to highest_hz (defaults chosen) into bands, in ascending order.
    coupling_onset_hz: None = no coupling was found. There is no middle band where the onset is None or not below
    direction_limit_hz, and no low band where the onset is not above lowest_hz. Raises ValueError where
    direction_limit_hz is not between lowest_hz and highest_hz."""
    if not lowest_hz < direction_limit_hz < highest_hz:
        raise ValueError(
            f"direction_limit_hz is {direction_limit_hz:g}; it must lie between {lowest_hz:g} and {highest_hz:g} Hz"
        )
    onset_hz = direction_limit_hz if coupling_onset_hz is None else min(coupling_onset_hz, direction_limit_hz)
    edges_hz = (lowest_hz, max(onset_hz, lowest_hz), direction_limit_hz, highest_hz)
    return tuple(
        FrequencyBand(name, low_hz, high_hz, method, reason)
        for (name, method, reason), low_hz, high_hz in zip(_BAND_METHODS, edges_hz[:-1], edges_hz[1:], strict=True)
        if low_hz < high_hz
    )


_BAND_METHODS = (
    ("low", "closed loop, rigid model", "Feedback is stable, the person acts at these speeds, and axes do not mix."),
    ("middle", "all axes equalized together", "Directions are felt, but the device mixes its axes."),
    ("high", "each axis separately", "Directions are hardly felt, so the axis may be chosen to spare a motor."),
)
"""Name, control method and reason of each band, from low to high."""
