"""Blind test on a device that a lab changes on purpose: the changes, the expected answers, and the scoring.

A change is right where the diagnosis returns one of the effects that it may show as: a loosened cable is backlash or a
loose joint, depending on its slack. The control, a change that changes nothing, counts against a diagnosis that names
anything. A value that was weighed or measured beforehand is compared with the interval of a parameter.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.diagnosis.document import Diagnosis
from analysis.evaluation.blind_test.confidence_intervals import IntervalEstimate, compute_share

CONTROL_CHANGE, NO_DIAGNOSIS = "nothing", "missing"
"""Name of the change that changes nothing (control); `ScoredLabel.verdict` of a recording without a diagnosis."""


@dataclass(frozen=True, slots=True)
class Change:
    """A change that the lab makes to the device."""

    name: str
    instruction: str
    effects: tuple[str, ...]
    """Effects of which any is a right answer; empty for the control."""
    unit: str
    """Unit of the value that the lab writes down for this change, the same as of the first parameter of each of these
    effects in a linear SI model; empty where there is none."""


CHANGES: tuple[Change, ...] = (
    Change(CONTROL_CHANGE, "Remove all attachments and mount them again, as if something were changed.", (), ""),
    Change(
        "added_mass",
        "Screw 20 to 100 g to the handle, close to its middle, and weigh them beforehand.",
        ("added_mass",),
        "kg",
    ),
    Change(
        "tilted_sensor",
        "Put a wedge of 3 to 15 degrees under the accelerometer and fasten it again.",
        ("sensor_misalignment",),
        "deg",
    ),
    Change(
        "loosened_cable",
        "Loosen the cable of one drive until its pulley has play that can be felt.",
        ("backlash", "loose_joint"),
        "m",
    ),
    Change(
        "magnet_brake",
        "Fix a strong magnet 2 to 5 mm from a sheet of copper or aluminium that moves with the handle.",
        ("viscous_damping",),
        "N s/m",
    ),
    Change(
        "held_handle",
        "One hand holds the handle lightly, as a pen, for the whole recording, of a copy of the protocol with hand = "
        '"held" (docs/kit.md).',
        ("hand_impedance", "time_varying_grip"),
        "",
    ),
)
"""All changes of the kit. The ranges in the instructions are chosen: changes that a lab can make and take back."""
CHANGES_BY_NAME = {kit_change.name: kit_change for kit_change in CHANGES}


@dataclass(frozen=True, slots=True)
class Label:
    """One row of the sealed table: the change that was made before a recording."""

    recording: str
    change: str
    """`Change.name`."""
    value: float | None
    """Value that the lab wrote down, in the unit of the change; None without one."""
    note: str
    salt: str
    """Random text, which prevents that the row is guessed from the hash of the table."""


@dataclass(frozen=True, slots=True)
class ScoredLabel:
    """A diagnosis with the change that was made: one row of the scored table."""

    recording: str
    change: str
    value: float | None
    """In the unit of the change; None where the lab wrote none down."""
    verdict: str
    """Verdict of the diagnosis, or `NO_DIAGNOSIS`."""
    named: str
    """Effects that the diagnosis names, separated by spaces."""
    returned: str
    """Effects of its returned set (the named ones and their inseparable rivals), separated by spaces."""
    right: bool
    inside: bool | None
    """Whether the written value lies in the 95 % interval (ends included) of the first parameter of the named effect,
    if it is one of the change. None where no value was written, the change has no unit, no such effect was named, or
    it has no interval in this unit (as on a rotating device); False where the diagnosis is missing although a value
    with a unit was written."""


def score_label(label: Label, diagnosis: Diagnosis) -> ScoredLabel:
    """Score a diagnosis: right where one of the change's effects is in the returned set; for no change, where no effect
    is named."""
    change = CHANGES_BY_NAME[label.change]
    named_effects = tuple(effect.effect for effect in diagnosis.effects)
    is_answer_right = (
        any(effect_name in diagnosis.returned_set for effect_name in change.effects)
        if change.effects
        else not named_effects
    )
    return ScoredLabel(
        label.recording,
        label.change,
        label.value,
        diagnosis.verdict,
        " ".join(named_effects),
        " ".join(diagnosis.returned_set),
        is_answer_right,
        _is_in_interval(label.value, change, diagnosis),
    )


def score_unanswered(label: Label) -> ScoredLabel:
    """Score a missing diagnosis as wrong, with its value in no interval, so that leaving one out raises no rate."""
    has_value = label.value is not None and bool(CHANGES_BY_NAME[label.change].unit)
    return ScoredLabel(
        label.recording, label.change, label.value, NO_DIAGNOSIS, "", "", False, False if has_value else None
    )


def _is_in_interval(value: float | None, change: Change, diagnosis: Diagnosis) -> bool | None:
    """Return whether the value lies in the interval that `ScoredLabel.inside` names, or None."""
    if value is None or not change.unit:
        return None
    for effect in diagnosis.effects:
        estimate = next(iter(effect.parameters.values()), None)
        if effect.effect not in change.effects or estimate is None or estimate.ci95 is None:
            continue
        if estimate.unit == change.unit:
            return estimate.ci95[0] <= value <= estimate.ci95[1]
    return None


def compute_kit_figures(rows: Sequence[ScoredLabel]) -> tuple[IntervalEstimate, ...]:
    """Compute the rates with Wilson's 95 % intervals: changes named right, controls without a name, written values in
    their interval, and for each change that occurs its rate of right names."""
    changed_rows = [row for row in rows if row.change != CONTROL_CHANGE]
    change_names = [change.name for change in CHANGES if any(row.change == change.name for row in changed_rows)]
    return (
        compute_share("changes named", changed_rows, lambda scored: scored.right),
        compute_share(
            "nothing changed, nothing named", _select_change(rows, CONTROL_CHANGE), lambda scored: scored.right
        ),
        compute_share(
            "written numbers inside their interval", _select_with_interval(rows), lambda scored: bool(scored.inside)
        ),
        *(
            compute_share(change_name, _select_change(rows, change_name), lambda scored: scored.right)
            for change_name in change_names
        ),
    )


def _select_change(rows: Sequence[ScoredLabel], change_name: str) -> list[ScoredLabel]:
    """Select the rows with this change."""
    return [row for row in rows if row.change == change_name]


def _select_with_interval(rows: Sequence[ScoredLabel]) -> list[ScoredLabel]:
    """Select the rows whose value was compared with an interval, or counts as outside."""
    return [row for row in rows if row.inside is not None]
