"""Frequency bands and the control method that suits each (the published figure 1)."""

from dataclasses import dataclass

PUBLISHED_DIRECTION_LIMIT_HZ = 35.0
"""Highest frequency at which people told directions apart on an omega.3 (Wilson, Chan, Salisbury, Niemeyer)."""


@dataclass(frozen=True, slots=True)
class FrequencyBand:
    """A band of frequencies, the control method that suits it, and the reason as a sentence."""

    name: str
    """low, middle or high"""
    low_hz: float
    high_hz: float
    method: str
    why: str


def frequency_bands(
    coupling_onset_hz: float | None,
    direction_limit_hz: float = PUBLISHED_DIRECTION_LIMIT_HZ,
    lowest_hz: float = 1.0,
    highest_hz: float = 500.0,
) -> tuple[FrequencyBand, ...]:
    """Bands in rising order. Without a middle band where coupling begins (None: not at all) above the limit of
    direction, because then no frequency needs all axes at once. Raises ValueError for a limit outside the range."""
    if not lowest_hz < direction_limit_hz < highest_hz:
        raise ValueError(
            f"direction_limit_hz is {direction_limit_hz:g}; it must lie between {lowest_hz:g} and {highest_hz:g} Hz"
        )
    onset_hz = direction_limit_hz if coupling_onset_hz is None else min(coupling_onset_hz, direction_limit_hz)
    edges = (lowest_hz, max(onset_hz, lowest_hz), direction_limit_hz, highest_hz)
    return tuple(
        FrequencyBand(name, low, high, method, why)
        for (name, method, why), low, high in zip(_METHODS, edges[:-1], edges[1:], strict=True)
        if low < high
    )


_METHODS = (
    ("low", "closed loop, rigid model", "Feedback is stable, the person acts at these speeds, and axes do not mix."),
    ("middle", "all axes equalized together", "Directions are felt, but the device mixes its axes."),
    ("high", "each axis by itself", "Directions are hardly felt, so the axis may be chosen to spare a motor."),
)
