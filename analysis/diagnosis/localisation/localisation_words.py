"""Sentences for the user about the localisation of a mismatch: where it enters (`entry_point`), and the states that it
depends on (`state_regions`)."""

from collections.abc import Sequence

from analysis.diagnosis.limits import ENTRY_LEAST_LINES, ENTRY_RIVAL_P
from analysis.diagnosis.localisation.entry_point import EntryPoint, EntryScore
from analysis.diagnosis.localisation.localisation import Localisation
from analysis.diagnosis.localisation.mismatch_rows import StateMismatch
from analysis.diagnosis.unit_wording import format_share
from analysis.wording import conjoin, format_p_text

_FORCE_SOURCES = "the drive, the mechanism and a hand all act there, and these channels do not distinguish them"
"""Possible sources of a force along one axis."""
_COMMON_FORCE_SOURCES = (
    "drives, the mechanism and a hand act in this way, and so does an error of timing, which shifts all channels "
    "equally"
)
"""Possible sources of a force along several axes."""


def write_localisation_sentences(localisation: Localisation) -> tuple[str, ...]:
    """Write sentences about the residual of the re-tuned model: where it enters, and the states that it depends on."""
    sentences = (
        write_entry_sentence(localisation.entry),
        write_states_sentence(localisation.states.get("retuned", ())),
    )
    return tuple(sentence for sentence in sentences if sentence)


def write_entry_sentence(entry: EntryPoint | None) -> str:
    """Write a sentence on the place where the mismatch enters; empty with too few lines of enough power."""
    if entry is None or not entry.ranking or entry.lines < ENTRY_LEAST_LINES:
        return ""
    best_entry = entry.ranking[0]
    sources = (
        ""
        if best_entry.place == "sensor"
        else f" ({_COMMON_FORCE_SOURCES if best_entry.axis is None else _FORCE_SOURCES})"
    )
    explained_text = f"{_format_share(best_entry)} of it, at the median of {entry.lines} frequency lines"
    return " ".join(
        filter(
            None,
            (
                f"The mismatch after re-tuning enters as {best_entry.name}{sources}: this explains "
                f"{explained_text}{_describe_rival_entries(entry)}.",
                _write_sensor_comparison(entry),
            ),
        )
    )


def write_states_sentence(states: Sequence[StateMismatch]) -> str:
    """Write a sentence on the states that the mismatch depends on; empty where there are none."""
    if not states:
        return ""
    state_phrases = [
        f"{state.output}, driven by {state.input}, {state.region.description} ({format_share(state.region.share)} of "
        f"the mismatch, {format_p_text(state.region.p_value)})"
        for state in states
    ]
    return f"The mismatch depends on a state: {'; '.join(state_phrases)}."


def _describe_rival_entries(entry: EntryPoint) -> str:
    """Describe, in clauses, the entries that the data cannot distinguish from the best, and the next best entry; may be
    empty."""
    best_entry, distinguishable = (
        entry.ranking[0],
        [score for score in entry.ranking[1:] if score.name not in entry.ranking[0].equivalents],
    )
    equivalents_text = (
        f"; {conjoin(best_entry.equivalents)} would have the same effect" if best_entry.equivalents else ""
    )
    # Entries along several axes contain those along each, and errors of several channels contain each channel's.
    rivals = [rival for rival in distinguishable if not (rival.axis is None and rival.place == best_entry.place)]
    if not rivals:
        return equivalents_text
    next_entry = rivals[0]
    p_text = format_p_text(next_entry.p_value)
    if next_entry.p_value > ENTRY_RIVAL_P:
        return (
            f"{equivalents_text}; {next_entry.name} would explain it about equally well ({_format_share(next_entry)}, "
            f"{p_text})"
        )
    return (
        f"{equivalents_text}; the next best entry is {next_entry.name} with {_format_share(next_entry)} "
        f"({p_text} for its being equally good)"
    )


def _write_sensor_comparison(entry: EntryPoint) -> str:
    """Write a sentence on the comparison of position and response (`SensorComparison`); empty where it is undecided."""
    if entry.sensor_comparison is None or entry.sensor_comparison.verdict == "undecided":
        return ""
    if entry.sensor_comparison.verdict == "motion":
        return (
            "The position shows the mismatch, too: the motion of the device itself differs from the model, and no "
            "sensor of the response is at fault."
        )
    return (
        "The position does not show the mismatch: the fault is in the measurement of the response, not in the motion "
        "of the device."
    )


def _format_share(score: EntryScore) -> str:
    """Format the share of the mismatch that the entry explains; a negative share as 0."""
    return format_share(max(score.share, 0.0))
