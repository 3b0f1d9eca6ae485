"""Words for what a run's threshold is: a mean of reversals, or the mean of Psi's posterior."""

from dataclasses import dataclass

from protocols.definition.staircase_rule import StaircaseRule


@dataclass(frozen=True, slots=True)
class ThresholdWords:
    """Sentences and nouns on a run's threshold, for a single kind of rule."""

    means: str
    """Thresholds of runs, in the plural; begins small."""
    cut: str
    """What the cap did to a threshold that is marked as cut."""
    cut_note: str
    """Below a table with such marks."""
    too_low: str
    """Why Tobit's model of them is no more than a sensitivity analysis."""
    measured_in: str
    """In which trials accelerations and displacements were measured."""
    levels: str
    """Why observed shares of right answers lie beside the curve of a model that is right."""
    track: str
    """What the figure of a run's levels shows."""
    sensitivity: str
    """What d' of the answers says beside a cue."""


CUT_END = (
    "On a stronger device the value would be higher; a bound it is not, the true threshold may lie to either side."
)
REVERSALS = ThresholdWords(
    means="reversal means",
    cut="which cut off peaks of the staircase",
    cut_note=f"cut: the cap cut off peaks of the staircase. {CUT_END}",
    too_low="reversal means near the cap are too low before they are cut, and a cut mean is no clean bound",
    measured_in="the trials of the averaged reversals",
    levels="A staircase stops going down where answers happen to be wrong, so the lowest points lie somewhat below the "
    "curve of a model that is right.",
    track="Level of every counted trial, right and wrong answers, and the reversals; the black ones are averaged into "
    "the threshold (solid line).",
    sensitivity="A staircase holds d' of the answers near 1.6 for any cue.",
)


def _psi(rule: StaircaseRule) -> ThresholdWords:
    last = rule.averaged_reversals
    return ThresholdWords(
        means="Psi's posterior means",
        cut="above which they lie by Psi's posterior with a probability over 10 %",
        cut_note="cut: by Psi's posterior the threshold lies above the cap with a probability over 10 %; the value is "
        "the posterior's mean, at most the cap.",
        too_low="a posterior mean is drawn towards the cap before it is cut, and a cut one is no clean bound",
        measured_in=f"the last {last} trials of each run, taken in proportion to the threshold" if last > 1
        else "the last trial of each run, taken in proportion to the threshold",
        levels="Levels followed the answers, so the lowest points lie somewhat beside the curve of a model that is "
        "right.",
        track="Level of every counted trial, chosen by Psi, with right and wrong answers; the line is the threshold, "
        "the mean of the posterior after the last answer.",
        sensitivity="Levels follow the answers, so d' of the answers hardly depends on the cue.",
    )  # fmt: skip


def threshold_words(rule: StaircaseRule) -> ThresholdWords:
    """The words for a rule: those of Psi's posterior where the rule is Bayesian, else those of reversals."""
    return _psi(rule) if rule.is_bayesian else REVERSALS


def capitalise_first(words: str) -> str:
    """The words with a capital first letter."""
    return f"{words[0].upper()}{words[1:]}"
