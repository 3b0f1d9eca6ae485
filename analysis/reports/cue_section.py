"""The section of a study report that asks whether direction was the cue."""

from collections.abc import Sequence

from analysis.psychophysics.cues.answers_on_delivery import RELYING, AnswersOnDelivery
from analysis.psychophysics.cues.cue_ability import INTERNAL_NOISE_DB, USUAL_NOISE_DB
from analysis.psychophysics.cues.cue_findings import CueFinding, cue_warnings, gap_text
from analysis.psychophysics.cues.delivered_cues import CueGap
from analysis.reports.page import Section, Table
from analysis.threshold_words import threshold_words
from analysis.wording import NONE, conjoin, format_signed, number, p_value
from protocols.definition.staircase_rule import StaircaseRule

_MEANING = (
    "A device seldom delivers both directions alike. What else differs can be noticed in place of the direction: how "
    "strong the vibration is along its direction (intensity), its harmonics (spectrum), the motion across it "
    "(coupling). Each is in dB; harmonics and motion across count by the most that they can add to the amplitude."
)


def cue_section(found: Sequence[CueFinding], gaps: Sequence[CueGap], rule: StaircaseRule) -> list[Section]:
    """Section on cues other than the direction; empty where no trial was measured."""
    if not found:
        return []
    sentences = (*(cue_warnings(found) or (_nothing(found),)), *filter(None, [gap_text(gaps)]))
    tables = (_ability_table(found, threshold_words(rule).sensitivity), _answer_table(found))
    return [Section("Was direction the cue?", paragraphs=(_MEANING, *sentences), tables=tables)]


def _nothing(found: Sequence[CueFinding]) -> str:
    unclear = [f"{each.cue.value} at {each.frequency_hz:g} Hz" for each in found if not each.answers.is_conclusive]
    return (
        "No difference that was measured is one that a usual judge notices, and no answers are shown to follow what "
        "was delivered."
        + (
            f" Too little varied within a direction to tell whether answers would have followed: {conjoin(unclear)}. "
            "A roved level (rove_db of [stimulus]) would tell for intensity."
            if unclear
            else ""
        )
    )


def _ability_table(found: Sequence[CueFinding], sensitivity: str) -> Table:
    return Table(
        caption="What each cue alone could do",
        header=(
            "Cue", "Frequency", "Difference (dB)", "Largest", "Spread (dB)",
            *(f"d' at {noise:g} dB" for noise in INTERNAL_NOISE_DB), "d' of the answers", "Noticeable for",
        ),
        rows=tuple(
            (
                each.cue.value, f"{each.frequency_hz:g} Hz", format_signed(each.difference_db),
                format_signed(each.largest_db), number(each.spread_db),
                *(number(ability) for ability in each.abilities), number(each.observed_d_prime),
                f"{len(each.noticed_by)} of {len(each.people)}",
            )
            for each in found
        ),
        notes=(
            "Difference: first direction minus second, by their angles; medians over participants, and the largest of "
            "any. Spread: standard deviation over trials of one direction at one level, roving included. d' = "
            "difference over internal noise and spread together, for three internal noises; 1 is one just noticeable "
            "difference.",
            f"Noticeable: shown, by a 95 % interval of the difference, to reach d' 1 at an internal noise of "
            f"{USUAL_NOISE_DB:g} dB. {sensitivity}",
        ),
    )  # fmt: skip


def _answer_table(found: Sequence[CueFinding]) -> Table:
    return Table(
        caption="Whether answers followed the delivery within a direction",
        header=("Cue", "Frequency", "Trials", "Varied by (dB)", "Logits per dB", "95 % interval", "p (Holm)", "Says"),
        rows=tuple(
            (
                each.cue.value, f"{each.frequency_hz:g} Hz", str(each.answers.trials),
                number(each.answers.residual_sd_db, 3), *_slope_texts(each.answers), p_value(each.p_holm), _judge(each),
            )
            for each in found
        ),
        notes=(
            "Logistic regression of answers on each trial's deviation from the others of that participant, direction "
            "and level. "
            f"A participant with an internal noise of {USUAL_NOISE_DB:g} dB who goes by the cue alone has "
            f"{number(RELYING, 1)} logits per dB, one who feels directions has 0.",
        ),
        folded=True,
    )  # fmt: skip


def _slope_texts(answers: AnswersOnDelivery) -> tuple[str, str]:
    if answers.slope is None or answers.lower is None or answers.upper is None:
        return NONE, NONE
    return format_signed(answers.slope), f"{format_signed(answers.lower)} to {format_signed(answers.upper)}"


def _judge(finding: CueFinding) -> str:
    if finding.followed:
        return "followed"
    return "not followed" if finding.answers.is_conclusive else "cannot tell"
