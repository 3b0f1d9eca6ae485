"""Sentences for the user about the localisation of a mismatch: where it enters, and the states that it depends on.

Called by the report and by `real_answer`; the numbers come from `entry_point` and `state_regions`.
"""

from collections.abc import Sequence

from analysis.diagnosis.localisation.entry_point import EntryPoint, EntryScore
from analysis.diagnosis.localisation.localisation import Localisation
from analysis.diagnosis.localisation.mismatch_rows import StateMismatch
from analysis.diagnosis.settings import ENTRY_AS_GOOD_P, ENTRY_LEAST_LINES
from analysis.diagnosis.unit_wording import share_text
from analysis.wording import conjoin, format_p_text

_FORCE = "the drive, the mechanism and a hand all act there, and these channels do not distinguish them"
_FORCES = (
    "drives, the mechanism and a hand act in this way, and so does an error of timing, which shifts all channels "
    "equally"
)


def localisation_sentences(local: Localisation) -> tuple[str, ...]:
    """Sentences about the residual of the re-tuned model: where it enters, and the states that it depends on."""
    texts = (entry_sentence(local.entry), states_sentence(local.states.get("retuned", ())))
    return tuple(sentence for sentence in texts if sentence)


def entry_sentence(entry: EntryPoint | None) -> str:
    """Sentence on the place where the mismatch enters; empty with too few lines of enough power."""
    if entry is None or not entry.ranking or entry.lines < ENTRY_LEAST_LINES:
        return ""
    best = entry.ranking[0]
    kind = "" if best.place == "sensor" else f" ({_FORCES if best.axis is None else _FORCE})"
    explained = f"{_percent(best)} of it, at the median of {entry.lines} frequency lines"
    return " ".join(
        filter(
            None,
            (
                f"The mismatch after re-tuning enters as {best.name}{kind}: this explains "
                f"{explained}{_rival_entry(entry)}.",
                _sensor_rule_sentence(entry),
            ),
        )
    )


def states_sentence(states: Sequence[StateMismatch]) -> str:
    """Sentence on the states that the mismatch depends on; empty where there are none."""
    if not states:
        return ""
    parts = [
        f"{state.output}, driven by {state.input}, {state.region.words} ({share_text(state.region.share)} of the "
        f"mismatch, {format_p_text(state.region.p_value)})"
        for state in states
    ]
    return f"The mismatch depends on a state: {'; '.join(parts)}."


def _rival_entry(entry: EntryPoint) -> str:
    """Clauses on entries that the data cannot distinguish from the best, and on the next best entry; may be empty."""
    best, distinguishable = (
        entry.ranking[0],
        [score for score in entry.ranking[1:] if score.name not in entry.ranking[0].equivalents],
    )
    equivalents = f"; {conjoin(best.equivalents)} would have the same effect" if best.equivalents else ""
    # Entries along several axes contain those along each, and errors of several channels contain each channel's.
    rivals = [rival for rival in distinguishable if not (rival.axis is None and rival.place == best.place)]
    if not rivals:
        return equivalents
    second = rivals[0]
    chance = format_p_text(second.p_value)
    if second.p_value > ENTRY_AS_GOOD_P:
        return f"{equivalents}; {second.name} would explain it about equally well ({_percent(second)}, {chance})"
    return (
        f"{equivalents}; the next best entry is {second.name} with {_percent(second)} "
        f"({chance} for its being equally good)"
    )


def _sensor_rule_sentence(entry: EntryPoint) -> str:
    """Sentence on the comparison of position and response (`SensorRule`); empty where it is undecided."""
    if entry.rule is None or entry.rule.verdict == "undecided":
        return ""
    if entry.rule.verdict == "motion":
        return (
            "The position shows the mismatch, too: the motion of the device itself differs from the model, and no "
            "sensor of the response is at fault."
        )
    return (
        "The position does not show the mismatch: the fault is in the measurement of the response, not in the motion "
        "of the device."
    )


def _percent(score: EntryScore) -> str:
    return share_text(max(score.share, 0.0))
