"""What arrived of the accelerations that were wanted, in a study whose stimuli are equalized."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from statistics import median

from analysis.wording import listed
from protocols.trial import Trial

NEAR = 0.1
"""A frequency where more than this share of what was wanted is missing, too much or off the direction is named."""


@dataclass(frozen=True, slots=True)
class Delivery:
    """At one frequency, over all trials that were measured. Medians of trials, direction by direction."""

    frequency_hz: float
    trials: int
    along: tuple[float | None, float | None]
    """Delivered over wanted, direction 1 and 2; None without a trial of it."""
    off_axis: float
    """Off the direction over what was delivered along it."""

    @property
    def as_wanted(self) -> bool:
        return self.off_axis <= NEAR and all(abs(one - 1) <= NEAR for one in self.along if one is not None)


def deliveries(trials: Sequence[Trial]) -> tuple[Delivery, ...]:
    """By rising frequency; empty where levels are commanded forces."""
    measured = [trial for trial in trials if trial.counts and trial.wanted_mps2 and trial.delivered_mps2]
    ordered = sorted(measured, key=lambda trial: trial.frequency_hz)
    return tuple(_delivery(hz, list(group)) for hz, group in groupby(ordered, key=lambda trial: trial.frequency_hz))


def delivery_warning(found: Sequence[Delivery]) -> str:
    """Empty where everything arrived as it was wanted."""
    off = [one for one in found if not one.as_wanted]
    if not off:
        return ""
    said = [
        f"{one.frequency_hz:g} Hz ({' and '.join(f'{100 * along:.0f} %' for along in one.along if along is not None)} "
        f"of what was wanted, {100 * one.off_axis:.0f} % off the direction)"
        for one in off
    ]
    return (
        f"The accelerations that arrived are not those that were wanted, by more than {100 * NEAR:.0f} % at the "
        f"median: {listed(said)}. Take the delivered accelerations, not the levels, for what was felt there."
    )


def _delivery(frequency_hz: float, trials: list[Trial]) -> Delivery:
    sides: list[float | None] = []
    for number in (1, 2):
        ratios = [_along(trial) for trial in trials if trial.direction_shown == number]
        sides.append(median(ratios) if ratios else None)
    return Delivery(
        frequency_hz,
        len(trials),
        (sides[0], sides[1]),
        median((trial.off_axis_mps2 or 0.0) / (trial.delivered_mps2 or 1.0) for trial in trials),
    )


def _along(trial: Trial) -> float:
    return (trial.delivered_mps2 or 0.0) / (trial.wanted_mps2 or 1.0)
