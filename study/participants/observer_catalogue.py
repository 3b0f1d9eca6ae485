"""Catalogue of the simulated participants by the names that `--observer` takes."""

import re
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

OBSERVER_DESCRIPTIONS = {
    "ideal": "feels directions as the median participant does, never lapses",
    "lapsing": "like ideal, but answers without attention one time in ten",
    "biased": "like ideal, but prefers answer 1",
    "guesser": "tosses a coin",
    "alternator": "says 1, 2, 1, 2",
    "always_1": "says 1 every time",
    "always_2": "says 2 every time",
    "vibration_only": "like ideal up to 20 Hz; above that, vibration without a direction",
    "intensity_cue": "feels no direction, but notices that direction 1 is delivered 3 dB stronger",
    "delivered": "like ideal, but feels what the device delivered: motion across, harmonics, and numbing count",
    "repeating": "like ideal, but asks for the same trial again when unsure",
    "criterion_drift": "like ideal, but increasingly prefers answer 2",
    "drifting": "like ideal, but thresholds rise by 1 dB every 100 trials",
    "scripted": "right or wrong by the trial's number alone",
    "person": "one of the simulated population, picked by the seed",
}
"""Description of each participant by its name, for help texts. Further names select a member of a simulated population:
`person_7_seed_1` is the seventh of population 1; `delivered_7_seed_1`, `repeating_7_seed_1` and
`criterion_drift_7_seed_1` have the same thresholds."""

_MEMBER_NAME = re.compile(rf"(?P<kind>{'|'.join(MEMBER_KINDS)})_(?P<number>[1-9]\d*)_seed_(?P<seed>\d+)")
"""Matches the name of a member of a simulated population: kind, number from 1, and seed of the population."""


def find_observer(name: str, seed: int) -> Observer:
    """Find the simulated participant of this name, with hyphens or underscores. seed: of the population of which
    "person" is the first member; unused for other names. Raises WrongUseError for an unknown name.

    The numbers of the participants below are chosen; units and meanings are those of the fields of `DirectionFeeler`.
    """
    observer_name = name.replace("-", "_")
    if member_match := _MEMBER_NAME.fullmatch(observer_name):
        return make_member(member_match["kind"], int(member_match["number"]), int(member_match["seed"]))
    typical_observer = DirectionFeeler(observer_name, TYPICAL_THRESHOLDS_N)
    observers: dict[str, Observer] = {
        "ideal": typical_observer,
        # One trial in ten without attention: half of these random answers are right.
        "lapsing": DirectionFeeler(observer_name, TYPICAL_THRESHOLDS_N, lapse=0.05),
        "biased": DirectionFeeler(observer_name, TYPICAL_THRESHOLDS_N, criterion=-0.5),
        "guesser": GuessingObserver(observer_name),
        "alternator": AlternatingObserver(observer_name),
        "always_1": ConstantObserver(observer_name, 1),
        "always_2": ConstantObserver(observer_name, 2),
        "vibration_only": DirectionFeeler(observer_name, TYPICAL_THRESHOLDS_N, numb_above_hz=20.0),
        "intensity_cue": IntensityCue(observer_name),
        "delivered": DeliveredFeeler(observer_name, typical_observer),
        "repeating": UnsureRepeater(observer_name, typical_observer),
        "criterion_drift": DirectionFeeler(observer_name, TYPICAL_THRESHOLDS_N, criterion_per_100_trials=0.3),
        "drifting": DirectionFeeler(observer_name, TYPICAL_THRESHOLDS_N, drift_db_per_100_trials=1.0),
        "scripted": ScriptedObserver(observer_name),
        "person": draw_person(1, seed),
    }
    if observer_name not in observers:
        suggestions = get_close_matches(observer_name, OBSERVER_DESCRIPTIONS, n=1)
        hint = f" Did you mean {suggestions[0]}?" if suggestions else ""
        raise WrongUseError(
            title="There is no such simulated participant",
            happened=f"No observer is called {name}.{hint}",
            do_now=f"Choose one of {', '.join(OBSERVER_DESCRIPTIONS)}.",
        )
    return observers[observer_name]
