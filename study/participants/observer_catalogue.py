"""Catalogue of the simulated participants by the names that `--observer` takes."""

import re
from collections.abc import Callable
from difflib import get_close_matches

from study.errors import WrongUseError
from study.participants.control_observers import (
    AlternatingObserver,
    ConstantObserver,
    GuessingObserver,
    ScriptedObserver,
)
from study.participants.delivered_feeler import DeliveredFeeler
from study.participants.direction_feeler import DirectionFeeler
from study.participants.intensity_cue import IntensityCue
from study.participants.observer import Observer
from study.participants.population import MEMBER_KINDS, TYPICAL_THRESHOLDS_N, draw_person, make_member
from study.participants.unsure_repeater import UnsureRepeater

OBSERVERS: dict[str, Callable[[str, int], Observer]] = {
    "ideal": lambda name, seed: DirectionFeeler(name, TYPICAL_THRESHOLDS_N),
    # One trial in ten without attention: half of these random answers are right.
    "lapsing": lambda name, seed: DirectionFeeler(name, TYPICAL_THRESHOLDS_N, lapse=0.05),
    "biased": lambda name, seed: DirectionFeeler(name, TYPICAL_THRESHOLDS_N, criterion=-0.5),  # prefers answer 1
    "guesser": lambda name, seed: GuessingObserver(name),
    "alternator": lambda name, seed: AlternatingObserver(name),
    "always_1": lambda name, seed: ConstantObserver(name, 1),
    "always_2": lambda name, seed: ConstantObserver(name, 2),
    "vibration_only": lambda name, seed: DirectionFeeler(name, TYPICAL_THRESHOLDS_N, numb_above_hz=20.0),
    "intensity_cue": lambda name, seed: IntensityCue(name),
    "delivered": lambda name, seed: DeliveredFeeler(name, DirectionFeeler(name, TYPICAL_THRESHOLDS_N)),
    "repeating": lambda name, seed: UnsureRepeater(name, DirectionFeeler(name, TYPICAL_THRESHOLDS_N)),
    "criterion_drift": lambda name, seed: DirectionFeeler(name, TYPICAL_THRESHOLDS_N, criterion_per_100_trials=0.3),
    "drifting": lambda name, seed: DirectionFeeler(name, TYPICAL_THRESHOLDS_N, drift_db_per_100_trials=1.0),
    "scripted": lambda name, seed: ScriptedObserver(name),
    "person": lambda name, seed: draw_person(1, seed),
}
"""Makes each participant from its name and the seed of a population. Numbers are chosen; their units and meanings are
those of the fields of `DirectionFeeler`. Further names select a member of a simulated population: `person_7_seed_1` is
the seventh of population 1; `delivered_7_seed_1`, `repeating_7_seed_1` and `criterion_drift_7_seed_1` have the same
thresholds."""

_MEMBER_NAME = re.compile(rf"(?P<kind>{'|'.join(MEMBER_KINDS)})_(?P<number>[1-9]\d*)_seed_(?P<seed>\d+)")
"""Matches the name of a member of a simulated population: kind, number from 1, and seed of the population."""


def find_observer(name: str, seed: int) -> Observer:
    """Find the simulated participant of this name, with hyphens or underscores. seed: of the population of which
    "person" is the first member; unused for other names. Raises WrongUseError for an unknown name."""
    observer_name = name.replace("-", "_")
    if member_match := _MEMBER_NAME.fullmatch(observer_name):
        return make_member(member_match["kind"], int(member_match["number"]), int(member_match["seed"]))
    if observer_name not in OBSERVERS:
        suggestions = get_close_matches(observer_name, OBSERVERS, n=1)
        hint = f" Did you mean {suggestions[0]}?" if suggestions else ""
        raise WrongUseError(
            title="There is no such simulated participant",
            happened=f"No observer is called {name}.{hint}",
            do_now=f"Choose one of {', '.join(OBSERVERS)}.",
        )
    return OBSERVERS[observer_name](observer_name, seed)
