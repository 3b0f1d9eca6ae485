"""Ratio of delivered to requested (target) acceleration by frequency and direction, in a study whose stimuli are
equalized.

Where two angles are known, the ratio is computed per direction of the device (its angle), not per number on the screen.
The numbers may be swapped between people; a device that delivers too much along one direction and too little along the
other would then seem correct on average.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from statistics import median

from analysis.wording import conjoin
from protocols.trial import Trial

DELIVERY_TOLERANCE = 0.1
"""Relative deviation from the requested acceleration, along or off the direction, above which a warning names the
frequency. Chosen."""


@dataclass(frozen=True, slots=True)
class Delivery:
    """Delivery at a single frequency: medians over the valid trials with a requested and a measured acceleration."""

    frequency_hz: float
    trials: int
    """Number of those trials, of both directions."""
    along: tuple[float | None, float | None]
    """Delivered over requested amplitude along the protocol's directions 1 and 2 (`_find_played_direction`); None for a
    direction without trials."""
    off_axis: float
    """Delivered amplitude off the direction over that along it; a trial without a measurement off the direction counts
    as 0."""

    @property
    def is_within_tolerance(self) -> bool:
        """Whether the delivered acceleration is within `DELIVERY_TOLERANCE` of the requested one, along the direction
        and off it."""
        return self.off_axis <= DELIVERY_TOLERANCE and all(
            abs(ratio - 1) <= DELIVERY_TOLERANCE for ratio in self.along if ratio is not None
        )


def compute_deliveries(trials: Sequence[Trial]) -> tuple[Delivery, ...]:
    """Compute the delivery at each frequency, ascending; empty without trials that have a requested acceleration, as
    where levels are forces, and a measured one."""
    measured_trials = [trial for trial in trials if trial.is_valid and trial.wanted_mps2 and trial.delivered_mps2]
    ordered_trials, first_angle_deg = (
        sorted(measured_trials, key=lambda trial: trial.frequency_hz),
        _find_larger_angle_deg(measured_trials),
    )
    return tuple(
        _summarise_delivery(frequency_hz, list(frequency_trials), first_angle_deg)
        for frequency_hz, frequency_trials in groupby(ordered_trials, key=lambda trial: trial.frequency_hz)
    )


def make_delivery_warning(deliveries: Sequence[Delivery]) -> str:
    """Make a sentence that names the frequencies with a deviation above `DELIVERY_TOLERANCE`; empty where there are
    none."""
    deviating_deliveries = [delivery for delivery in deliveries if not delivery.is_within_tolerance]
    if not deviating_deliveries:
        return ""
    deviation_texts = [
        f"{delivery.frequency_hz:g} Hz "
        f"({' and '.join(f'{100 * ratio:.0f} %' for ratio in delivery.along if ratio is not None)} "
        f"of the target, {100 * delivery.off_axis:.0f} % off the direction)"
        for delivery in deviating_deliveries
    ]
    return (
        f"The delivered accelerations deviate from their targets by more than {100 * DELIVERY_TOLERANCE:.0f} % at the "
        f"median: {conjoin(deviation_texts)}. Take the delivered accelerations, not the levels, for what was "
        "felt there."
    )


def _summarise_delivery(frequency_hz: float, trials: list[Trial], first_angle_deg: float | None) -> Delivery:
    """Compute the medians of the trials (at least one) at one frequency. first_angle_deg: angle of direction 1; None
    where it is not known."""
    median_ratios: list[float | None] = []
    for direction in (1, 2):
        ratios = [
            _compute_delivery_ratio(trial)
            for trial in trials
            if _find_played_direction(trial, first_angle_deg) == direction
        ]
        median_ratios.append(median(ratios) if ratios else None)
    return Delivery(
        frequency_hz,
        len(trials),
        (median_ratios[0], median_ratios[1]),
        median((trial.off_axis_mps2 or 0.0) / (trial.delivered_mps2 or 1.0) for trial in trials),
    )


def _find_larger_angle_deg(trials: Sequence[Trial]) -> float | None:
    """Find the angle of the protocol's direction 1, the larger of the two; None unless the trials have exactly two
    angles."""
    angles_deg = {trial.angle_deg for trial in trials}
    return (
        max((angle_deg for angle_deg in angles_deg if angle_deg is not None), default=None)
        if len(angles_deg - {None}) == 2
        else None
    )


def _find_played_direction(trial: Trial, first_angle_deg: float | None) -> int:
    """Find the protocol's direction that was played, 1 or 2, by its angle; where the angles are not known, the number
    that the direction had on the screen."""
    if first_angle_deg is None or trial.angle_deg is None:
        return trial.direction_shown
    return 1 if trial.angle_deg == first_angle_deg else 2


def _compute_delivery_ratio(trial: Trial) -> float:
    """Compute the delivered over the requested acceleration amplitude of a trial that has both."""
    return (trial.delivered_mps2 or 0.0) / (trial.wanted_mps2 or 1.0)
