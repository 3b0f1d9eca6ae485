"""Delivered over wanted accelerations in a study whose stimuli are equalized."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from statistics import median

from analysis.wording import conjoin
from protocols.trial import Trial

NEAR = 0.1
"""Relative deviation from the wanted acceleration, along or off the direction, from which a frequency is named."""


@dataclass(frozen=True, slots=True)
class Delivery:
    """Delivery at a single frequency, over all measured trials: medians by direction."""

    frequency_hz: float
    trials: int
    along: tuple[float | None, float | None]
    """Delivered over wanted, direction 1 and 2; None without a trial of it."""
    off_axis: float
    """Off the direction over what was delivered along it."""

    @property
    def is_as_wanted(self) -> bool:
        """Whether what was delivered is within `NEAR` of what was wanted, along the direction and off it."""
        return self.off_axis <= NEAR and all(abs(ratio - 1) <= NEAR for ratio in self.along if ratio is not None)


def deliveries(trials: Sequence[Trial]) -> tuple[Delivery, ...]:
    """Deliveries by rising frequency; empty where levels are commanded forces."""
    measured = [trial for trial in trials if trial.counts and trial.wanted_mps2 and trial.delivered_mps2]
    ordered = sorted(measured, key=lambda trial: trial.frequency_hz)
    return tuple(
        _summarise_delivery(hz, list(group)) for hz, group in groupby(ordered, key=lambda trial: trial.frequency_hz)
    )


def delivery_warning(found: Sequence[Delivery]) -> str:
    """A warning that names the frequencies with deviations; empty where there are none."""
    off = [delivery for delivery in found if not delivery.is_as_wanted]
    if not off:
        return ""
    texts = [
        f"{delivery.frequency_hz:g} Hz "
        f"({' and '.join(f'{100 * along:.0f} %' for along in delivery.along if along is not None)} "
        f"of what was wanted, {100 * delivery.off_axis:.0f} % off the direction)"
        for delivery in off
    ]
    return (
        f"The accelerations that arrived are not those that were wanted, by more than {100 * NEAR:.0f} % at the "
        f"median: {conjoin(texts)}. Take the delivered accelerations, not the levels, for what was felt there."
    )


def _summarise_delivery(frequency_hz: float, trials: list[Trial]) -> Delivery:
    sides: list[float | None] = []
    for number in (1, 2):
        ratios = [_delivery_ratio(trial) for trial in trials if trial.direction_shown == number]
        sides.append(median(ratios) if ratios else None)
    return Delivery(
        frequency_hz,
        len(trials),
        (sides[0], sides[1]),
        median((trial.off_axis_mps2 or 0.0) / (trial.delivered_mps2 or 1.0) for trial in trials),
    )


def _delivery_ratio(trial: Trial) -> float:
    return (trial.delivered_mps2 or 0.0) / (trial.wanted_mps2 or 1.0)
