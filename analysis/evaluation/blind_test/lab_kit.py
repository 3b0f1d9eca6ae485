"""Blind test on a device that a lab changes on purpose: the changes, the expected answers, and the scoring.

A change is right where the diagnosis returns one of the effects that it may show as: a loosened cable is backlash or a
loose joint, depending on its slack. The control, a change that changes nothing, counts against a diagnosis that names
anything. A value that was weighed or measured beforehand is compared with the 95 % interval of the first parameter; a
value of a change without a unit is kept in the table and compared with nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.diagnosis.document import Diagnosis
from analysis.evaluation.blind_test.confidence_intervals import IntervalEstimate, compute_share

CONTROL_CHANGE, MISSING = "nothing", "missing"
"""Name of the change that changes nothing (control); verdict of a recording without a diagnosis."""


@dataclass(frozen=True, slots=True)
class Change:
    """A change that the lab makes to the device."""

    name: str
    instruction: str
    """Instruction to the lab."""
    effects: tuple[str, ...]
    """Effects of which any is a right answer; empty for the control. The value is a parameter of the first of them."""
    unit: str
    """Unit of the value that the lab writes down for this change, the same as of the effect's first parameter; empty
    where there is none."""


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
        "One hand holds the handle lightly, as a pen, for the whole recording.",
        ("hand_impedance", "time_varying_grip"),
        "",
    ),
)
CHANGES_BY_NAME = {kit_change.name: kit_change for kit_change in CHANGES}


@dataclass(frozen=True, slots=True)
class Label:
    """One row of the sealed table. `salt` keeps its hash from being guessed."""

    recording: str
    change: str
    value: float | None
    note: str
    salt: str


@dataclass(frozen=True, slots=True)
class Scored:
    """A diagnosis with the change that was made: one row of the scored table."""

    recording: str
    change: str
    value: float | None
    """In the unit of the change; None where the lab wrote none down."""
    verdict: str
    """The diagnosis's, or `MISSING`."""
    named: str
    """Effects that the diagnosis names, separated by spaces."""
    returned: str
    """Effects of its returned set (the named ones and their inseparable rivals), separated by spaces."""
    right: bool
    inside: bool | None
    """Whether the written value lies in the 95 % interval of the effect named; None where no value was written, the
    change has no unit, or the effect was not named."""


def score_label(label: Label, diagnosis: Diagnosis) -> Scored:
    """Score a diagnosis: right where one of the change's effects is in the returned set; for no change, where no effect
    is named."""
    change = CHANGES_BY_NAME[label.change]
    named_effects = tuple(effect.effect for effect in diagnosis.effects)
    is_answer_right = (
        any(effect_name in diagnosis.returned_set for effect_name in change.effects)
        if change.effects
        else not named_effects
    )
    return Scored(
        label.recording,
        label.change,
        label.value,
        diagnosis.verdict,
        " ".join(named_effects),
        " ".join(diagnosis.returned_set),
        is_answer_right,
        _is_in_interval(label.value, change, diagnosis),
    )


def score_unanswered(label: Label) -> Scored:
    """Score a missing diagnosis as wrong, with its value in no interval, so that leaving one out raises no rate."""
    has_value = label.value is not None and bool(CHANGES_BY_NAME[label.change].unit)
    return Scored(label.recording, label.change, label.value, MISSING, "", "", False, False if has_value else None)


def _is_in_interval(value: float | None, change: Change, diagnosis: Diagnosis) -> bool | None:
    """As `Scored.inside`, for the first of the change's effects alone, whose first parameter has the value's unit."""
    if value is None or not change.unit:
        return None
    for effect in diagnosis.effects:
        interval = next(iter(effect.parameters.values())).ci95 if effect.parameters else None
        if effect.effect == change.effects[0] and interval is not None:
            return interval[0] <= value <= interval[1]
    return None


def compute_kit_figures(rows: Sequence[Scored]) -> tuple[IntervalEstimate, ...]:
    """Rates with Wilson's 95 % intervals."""
    changed_rows = [row for row in rows if row.change != CONTROL_CHANGE]
    kinds = [change.name for change in CHANGES if any(row.change == change.name for row in changed_rows)]
    return (
        compute_share("changes named", changed_rows, lambda scored: scored.right),
        compute_share(
            "nothing changed, nothing named", _select_change(rows, CONTROL_CHANGE), lambda scored: scored.right
        ),
        compute_share(
            "written numbers inside their interval", _select_with_interval(rows), lambda scored: bool(scored.inside)
        ),
        *(compute_share(kind, _select_change(rows, kind), lambda scored: scored.right) for kind in kinds),
    )


def _select_change(rows: Sequence[Scored], change: str) -> list[Scored]:
    return [row for row in rows if row.change == change]


def _select_with_interval(rows: Sequence[Scored]) -> list[Scored]:
    return [row for row in rows if row.inside is not None]
