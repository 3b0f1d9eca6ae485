"""Ratio of delivered to wanted acceleration by frequency and direction, in a study whose stimuli are equalized.

The ratio is computed per direction of the device (its angle), not per number on the screen. The numbers may be swapped
between people; a device that delivers too much along one direction and too little along the other would then seem
correct on average.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from statistics import median

from analysis.wording import conjoin
from protocols.trial import Trial

TOLERANCE = 0.1
"""Relative deviation from the wanted acceleration, along or off the direction, above which a warning names the
frequency."""


@dataclass(frozen=True, slots=True)
class Delivery:
    """Delivery at a single frequency: medians over all counted trials with a measured acceleration."""

    frequency_hz: float
    trials: int
    along: tuple[float | None, float | None]
    """Delivered over wanted amplitude, along the protocol's directions 1 and 2; None for a direction without trials."""
    off_axis: float
    """Amplitude off the direction over that along it, both as delivered."""

    @property
    def is_within_tolerance(self) -> bool:
        """Whether the delivered acceleration is within `TOLERANCE` of the wanted one, along the direction and off
        it."""
        return self.off_axis <= TOLERANCE and all(
            abs(ratio - 1) <= TOLERANCE for ratio in self.along if ratio is not None
        )


def deliveries(trials: Sequence[Trial]) -> tuple[Delivery, ...]:
    """Deliveries by rising frequency; empty where levels are commanded forces."""
    measured = [trial for trial in trials if trial.counts and trial.wanted_mps2 and trial.delivered_mps2]
    ordered, first_deg = sorted(measured, key=lambda trial: trial.frequency_hz), _larger_angle_deg(measured)
    return tuple(
        _summarise_delivery(hz, list(group), first_deg)
        for hz, group in groupby(ordered, key=lambda trial: trial.frequency_hz)
    )


def delivery_warning(results: Sequence[Delivery]) -> str:
    """Sentence that names the frequencies with a deviation above `TOLERANCE`; empty where there are none."""
    deviating = [delivery for delivery in results if not delivery.is_within_tolerance]
    if not deviating:
        return ""
    texts = [
        f"{delivery.frequency_hz:g} Hz "
        f"({' and '.join(f'{100 * ratio:.0f} %' for ratio in delivery.along if ratio is not None)} "
        f"of what was wanted, {100 * delivery.off_axis:.0f} % off the direction)"
        for delivery in deviating
    ]
    return (
        f"The accelerations that arrived are not those that were wanted, by more than {100 * TOLERANCE:.0f} % at the "
        f"median: {conjoin(texts)}. Take the delivered accelerations, not the levels, for what was felt there."
    )


def _summarise_delivery(frequency_hz: float, trials: list[Trial], first_deg: float | None) -> Delivery:
    """Medians of the trials at one frequency. first_deg: angle of direction 1; None where it is not known."""
    medians: list[float | None] = []
    for direction in (1, 2):
        ratios = [_delivery_ratio(trial) for trial in trials if _find_played_direction(trial, first_deg) == direction]
        medians.append(median(ratios) if ratios else None)
    return Delivery(
        frequency_hz,
        len(trials),
        (medians[0], medians[1]),
        median((trial.off_axis_mps2 or 0.0) / (trial.delivered_mps2 or 1.0) for trial in trials),
    )


def _larger_angle_deg(trials: Sequence[Trial]) -> float | None:
    """Angle of the protocol's direction 1, the larger of the two; None unless the trials have exactly two angles."""
    angles = {trial.angle_deg for trial in trials}
    return max((angle for angle in angles if angle is not None), default=None) if len(angles - {None}) == 2 else None


def _find_played_direction(trial: Trial, first_deg: float | None) -> int:
    """The protocol's direction that was played; its number on the screen where the angles are not known."""
    if first_deg is None or trial.angle_deg is None:
        return trial.direction_shown
    return 1 if trial.angle_deg == first_deg else 2


def _delivery_ratio(trial: Trial) -> float:
    """Delivered over wanted acceleration amplitude."""
    return (trial.delivered_mps2 or 0.0) / (trial.wanted_mps2 or 1.0)
