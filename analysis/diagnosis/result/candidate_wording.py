"""Write sentences on classes of laws that the data cannot distinguish, and on unconfirmed candidates.

A class contains a named effect and the effects that explain the held-out data equally well; where all of them belong to
a family of `_LAW_FAMILIES`, its name is stated, too.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from analysis.diagnosis.document import Candidate, Diagnosis, Estimate, NamedEffect, format_law
from analysis.diagnosis.effect_words import (
    SIMULATED_AS_FORMULA,
    format_parameters,
    format_place,
    get_noun,
    get_parameter_unit,
)
from analysis.diagnosis.unit_wording import format_share, typeset_unit
from analysis.wording import capitalise, end_sentence
from equalizer.signals.unit_system import UnitSystem

_LAW_FAMILIES = (
    (
        "friction",
        "friction whose law these data do not determine",
        {"coulomb_friction", "asymmetric_friction", "stribeck_friction", "presliding_hysteresis",
         "position_dependent_friction", "viscous_damping", "quadratic_damping", "drifting_friction",
         "condition_dependent_friction"},
    ),
    (
        "a stiffness that changes along the travel",
        "a stiffness whose law these data do not determine",
        {"hardening_stiffness", "asymmetric_stiffness", "end_stop", "backlash", "gravity_torque", "loose_joint"},
    ),
    (
        "a late command: lag or delay",
        "a late command: lag or delay, which these data do not distinguish",
        {"amplifier_lag", "transport_delay"},
    ),
    (
        "a late reading: lag or delay",
        "a late reading: lag or delay, which these data do not distinguish",
        {"sensor_lag", "logger_offset", "clock_drift"},
    ),
    (
        "a late command or reading: lag or delay",
        "a late command or reading, by lag or delay, which these data do not distinguish",
        {"amplifier_lag", "transport_delay", "sensor_lag", "logger_offset"},
    ),
    (
        "an effect that holds an axis at rest",
        "dead band or friction, because the axis rests exactly where either would hold it",
        {"force_deadband", "coulomb_friction"},
    ),
)  # fmt: skip
"""Families of effects with similar forces or delays: (short name, beginning of a sentence, names of the members). A
short name with a colon lists the members itself."""

REFINEMENT_REASON = (
    "it holds the named law as a special case, and what it allows beyond that brings nothing on held-out data"
)
"""Reason, stored in `Rival.why_not`, for a law that contains the named law as a special case without a gain."""
SENTENCE_COUNT = 3
"""Largest number of candidates that are described in sentences."""


@dataclass(frozen=True, slots=True)
class DeviceWording:
    """Properties of the device and its recordings on which the wording depends."""

    is_single_axis: bool
    """Whether the device has a single axis, whose name is then left out."""
    system: UnitSystem
    """Units of the recordings."""
    noise: str = ""
    """Origin of the noise estimate, `NoiseFloor.method`; empty where it is not known."""
    reading_units: Mapping[str | None, str] = field(default_factory=dict)
    """As `Findings.reading_units`; empty where they are not known."""


def format_class_noun(effect: NamedEffect) -> str:
    """Format the name of an effect with its class, such as "friction (dry friction, or 2 laws like it)"; the name of
    the effect alone where it has no class, or no family contains the class; the family's name alone where it lists the
    members itself."""
    names = _list_class_names(effect)
    rival_count = len(names) - 1
    family = _find_family(names)
    if rival_count < 1 or family is None:
        return get_noun(names[0])
    if ":" in family[0]:
        return family[0]
    return f"{family[0]} ({get_noun(names[0])}, or {rival_count} {'law' if rival_count == 1 else 'laws'} like it)"


def describe_class(effect: NamedEffect) -> str:
    """Describe the effects that explain the data as well as this effect; empty where the data distinguish it from all
    others."""
    inseparable_names = [rival.effect for rival in effect.rivals if rival.inseparable]
    names = tuple(dict.fromkeys((*_list_class_names(effect), *inseparable_names)))
    if len(names) < 2:
        return ""
    family = _find_family(names)
    family_title = family[1] if family is not None else "one of several laws that these data do not distinguish"
    return (
        f"{capitalise(family_title)}: {', '.join(map(get_noun, names[:-1]))} or {get_noun(names[-1])} would each "
        f"explain it equally well on held-out data. The parameters are those of {get_noun(names[0])}."
    )


def describe_refinements(effect: NamedEffect) -> str:
    """Describe the tested laws that contain the named law as a special case without a gain; empty without such laws."""
    names = [get_noun(rival.effect) for rival in effect.rivals if rival.why_not == REFINEMENT_REASON]
    if not names:
        return ""
    names_text = f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else names[0]
    predicate_text = (
        "are refinements of this law and bring" if len(names) > 1 else "is a refinement of this law and brings"
    )
    return f"{capitalise(names_text)} {predicate_text} no gain on held-out data."


def _list_class_names(effect: NamedEffect) -> tuple[str, ...]:
    """List the names of the effect and its class, the effect first; where the effect is a formula that replaces a named
    law in the simulation (`SIMULATED_AS_FORMULA`), the formula is left out."""
    names = effect.class_ or (effect.effect,)
    is_formula = effect.law is not None and len(names) > 1 and names[1] in SIMULATED_AS_FORMULA
    return names[1:] if is_formula else names


def _find_family(names: Sequence[str]) -> tuple[str, str] | None:
    """Find short name and title of the first family that contains all names; None where none does."""
    return next(((name, title) for name, title, members in _LAW_FAMILIES if set(names) <= members), None)


def format_candidate(candidate: Candidate, device: DeviceWording | None = None) -> str:
    """Format a candidate: effect, place and, if there are any, parameters or its formula."""
    place_text = format_place(candidate.place, candidate.axis, device is not None and device.is_single_axis)
    values_text = format_candidate_parameters(candidate, device)
    return f"{get_noun(candidate.effect)} {place_text}{f', {values_text}' if values_text else ''}"


def format_candidate_parameters(candidate: Candidate, device: DeviceWording | None = None) -> str:
    """Format the parameters of a candidate with units, or its formula; empty without parameters. device: None = not
    known; the numbers are then in SI, without units, and with exponents such as e-5 instead of e-05."""
    if candidate.law is not None:
        return format_law(candidate.law, "" if device is None else typeset_unit(device.system.force))
    if device is None:
        text = ", ".join(
            f"{name.replace('_', ' ')} {value:.3g}".replace("e-0", "e-") for name, value in candidate.parameters.items()
        )
        return f"{text} (SI)" if text else ""
    reading_unit = device.reading_units.get(candidate.axis, "1")
    return format_parameters(
        candidate.effect,
        {
            name: Estimate(value, get_parameter_unit(candidate.effect, name, device.system, reading_unit))
            for name, value in candidate.parameters.items()
        },
    )


def describe_candidates(diagnosis: Diagnosis, device: DeviceWording | None = None) -> tuple[str, ...]:
    """Describe the best `SENTENCE_COUNT` candidates, a text each; the first is left out where `describe_best_candidate`
    describes it."""
    reported_count = 1 if describe_best_candidate(diagnosis, device) else 0
    return tuple(
        f"Not confirmed: {_describe_gain(candidate, device)}"
        for candidate in diagnosis.candidates[reported_count:SENTENCE_COUNT]
    )


def describe_best_candidate(diagnosis: Diagnosis, device: DeviceWording | None = None) -> str:
    """Describe the best candidate where the verdict is "unexplained"; empty for other verdicts, or without a
    candidate."""
    if diagnosis.verdict != "unexplained" or not diagnosis.candidates:
        return ""
    return f"Best candidate, not confirmed: {_describe_gain(diagnosis.candidates[0], device)}"


def _describe_gain(candidate: Candidate, device: DeviceWording | None) -> str:
    """Describe a candidate, its gain on held-out data, and the reason not to name it."""
    return (
        f"{format_candidate(candidate, device)}. It would explain {format_share(candidate.held_out_gain)} of the "
        f"error's power on held-out data, {format_share(candidate.share_of_black_box)} of what all laws together "
        "explain. "
        f"Reason not to name it: {end_sentence(candidate.why_not)}"
    )
