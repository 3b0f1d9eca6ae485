"""Sentences for the user about classes of laws that the data cannot distinguish, and about unconfirmed candidates.

A class holds a named effect and the effects that explain the held-out data equally well; where all are of a family
below, the family's name takes the place of the list.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.diagnosis.document import Candidate, Diagnosis, Estimate, NamedEffect
from analysis.diagnosis.effect_words import PLAYED_AS_FORMULA, noun_of, parameters_text, place_words, unit_of
from analysis.diagnosis.unit_wording import share_text
from analysis.wording import capitalise, end_sentence
from equalizer.signals.unit_system import UnitSystem

_FAMILIES = (
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
"""Families of effects with similar forces or delays: short name, beginning of a sentence, and members."""

REFINED = "it holds the named law as a special case, and what it allows beyond that brings nothing on held-out data"
"""Reason for which a law that refines the named one is not reported as a rival."""
SENTENCES = 3
"""Number of candidates in the sentences; the document and the page's table list all."""


@dataclass(frozen=True, slots=True)
class Device:
    """Facts about the device and its recordings that the sentences need."""

    single: bool
    """Whether it has a single axis, which is then not named."""
    system: UnitSystem
    noise: str = ""
    """`NoiseFloor.how`; empty where it is not known."""


def class_noun(effect: NamedEffect) -> str:
    """Name of an effect with its class, such as "friction (dry friction, or 2 laws like it)"; its own name without a
    class."""
    names = _class_names(effect)
    rival_count = len(names) - 1
    family = _family(names)
    if rival_count < 1 or family is None:
        return noun_of(names[0])
    if ":" in family[0]:
        return family[0]
    return f"{family[0]} ({noun_of(names[0])}, or {rival_count} {'law' if rival_count == 1 else 'laws'} like it)"


def class_sentence(effect: NamedEffect) -> str:
    """Sentence on the effects that would explain the data as well; empty where the data distinguish it from all
    others."""
    inseparable = [rival.effect for rival in effect.rivals if rival.inseparable]
    names = tuple(dict.fromkeys((*_class_names(effect), *inseparable)))
    if len(names) < 2:
        return ""
    family = _family(_class_names(effect))
    title = family[1] if family is not None else "one of several laws that these data do not distinguish"
    return (
        f"{capitalise(title)}: {', '.join(map(noun_of, names[:-1]))} or {noun_of(names[-1])} would each explain it "
        f"equally well on held-out data. The parameters are those of {noun_of(names[0])}."
    )


def refinement_sentence(effect: NamedEffect) -> str:
    """A sentence on laws that contain the named law as a special case; empty where none was tested."""
    names = [noun_of(rival.effect) for rival in effect.rivals if rival.why_not == REFINED]
    if not names:
        return ""
    text = f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else names[0]
    hold = "are refinements of this law and bring" if len(names) > 1 else "is a refinement of this law and brings"
    return f"{capitalise(text)} {hold} no gain on held-out data."


def _class_names(effect: NamedEffect) -> tuple[str, ...]:
    """Names of the effect and its class; for a formula that simulates a law with a name, the names of the class
    only."""
    names = effect.class_ or (effect.effect,)
    formula = effect.law is not None and len(names) > 1 and names[1] in PLAYED_AS_FORMULA
    return names[1:] if formula else names


def _family(names: Sequence[str]) -> tuple[str, str] | None:
    """Short name and title of the first family that contains all names; None where none does."""
    return next(((name, title) for name, title, members in _FAMILIES if set(names) <= members), None)


def candidate_title(candidate: Candidate, device: Device | None = None) -> str:
    """A candidate with its place and parameters."""
    place = place_words(candidate.place, candidate.axis, device is not None and device.single)
    numbers = candidate_parameters(candidate, device)
    return f"{noun_of(candidate.effect)} {place}{f', {numbers}' if numbers else ''}"


def candidate_parameters(candidate: Candidate, device: Device | None = None) -> str:
    """The parameters of a candidate with units. device: None = not known, so that bare SI numbers are given."""
    if device is None:
        text = ", ".join(
            f"{name.replace('_', ' ')} {value:.3g}".replace("e-0", "e-") for name, value in candidate.parameters.items()
        )
        return f"{text} (SI)" if text else ""
    units = {name: unit_of(candidate.effect, name, device.system) for name in candidate.parameters}
    return parameters_text(candidate.effect, {k: Estimate(v, units[k]) for k, v in candidate.parameters.items()})


def candidate_sentences(diagnosis: Diagnosis, device: Device | None = None) -> tuple[str, ...]:
    """A sentence for each of the best `SENTENCES` candidates, without that of `best_candidate_sentence`."""
    reported_count = 1 if best_candidate_sentence(diagnosis, device) else 0
    return tuple(
        f"Not confirmed: {_with_gain(candidate, device)}"
        for candidate in diagnosis.candidates[reported_count:SENTENCES]
    )


def best_candidate_sentence(diagnosis: Diagnosis, device: Device | None = None) -> str:
    """Sentence on the best candidate of an unexplained mismatch; empty for other verdicts, and without a candidate."""
    if diagnosis.verdict != "unexplained" or not diagnosis.candidates:
        return ""
    return f"Best candidate, not confirmed: {_with_gain(diagnosis.candidates[0], device)}"


def _with_gain(candidate: Candidate, device: Device | None) -> str:
    """The candidate with its gain on held-out data, and the reason why it is not named."""
    return (
        f"{candidate_title(candidate, device)}. It would explain {share_text(candidate.held_out_gain)} of the error's "
        f"power on held-out data, {share_text(candidate.share_of_black_box)} of what all laws together explain. "
        f"Reason not to name it: {end_sentence(candidate.why_not)}"
    )
