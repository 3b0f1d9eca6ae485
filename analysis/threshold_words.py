"""Wording of figures, tables and warnings for the two kinds of thresholds of a run.

A staircase's threshold is the mean of its last reversal levels; that of the Bayesian Psi method is the mean of the
posterior distribution (`analysis.psychophysics.thresholds`). Begin at `select_threshold_words`.
"""

from dataclasses import dataclass

from protocols.definition.staircase_rule import StaircaseRule


@dataclass(frozen=True, slots=True)
class ThresholdWords:
    """Sentences and nouns about a run's threshold, for one kind of rule."""

    noun: str
    """Name of the thresholds, in the plural, as within a sentence."""
    cut_clause: str
    """Relative clause: effect of the cap (largest level) on a threshold that is marked as cut (limited by the cap)."""
    cut_note: str
    """Note below a table in which thresholds are marked as cut."""
    tobit_caveat: str
    """Reason why Tobit's model of cut thresholds is only a sensitivity analysis."""
    measured_in: str
    """Trials in which accelerations and displacements were measured, as a noun phrase."""
    misfit_note: str
    """Sentence: why observed shares of correct answers deviate from the psychometric function of a correct model."""
    run_caption: str
    """Caption of the figure of a run's levels."""
    d_prime_note: str
    """Sentence: what the observed d' says when it is compared with the d' of a cue."""


CENSORING_NOTE = (
    "On a stronger device the value would be higher; it is not a bound, because the true threshold may lie to either "
    "side."
)
"""Sentence on what a threshold that the cap cut means."""
REVERSAL_WORDS = ThresholdWords(
    noun="reversal means",
    cut_clause="which cut off peaks of the staircase",
    cut_note=f"cut: the cap cut off peaks of the staircase. {CENSORING_NOTE}",
    tobit_caveat="reversal means near the cap are too low before they are cut, and a cut mean is not a bound of the "
    "threshold",
    measured_in="the trials of the averaged reversals",
    misfit_note="A staircase stops descending where answers happen to be wrong, so the lowest points lie somewhat "
    "below the curve even of a correct model.",
    run_caption="Level of every counted trial, right and wrong answers, and the reversals; the black ones are averaged "
    "into the threshold (solid line).",
    d_prime_note="A staircase keeps d' of the answers near 1.6 for any cue.",
)
"""Words for staircases."""


def _make_psi_words(rule: StaircaseRule) -> ThresholdWords:
    """Make the words for the Psi method. Physical units are measured in the last `averaged_reversals` trials."""
    trial_count = rule.averaged_reversals
    return ThresholdWords(
        noun="Psi's posterior means",
        cut_clause="above which they lie by Psi's posterior with a probability over 10 %",
        cut_note="cut: by Psi's posterior the threshold lies above the cap with a probability over 10 %; the value is "
        "the posterior's mean, at most the cap.",
        tobit_caveat="a posterior mean is biased towards the cap before it is cut, and a cut one is not a bound of the "
            "threshold",
        measured_in=f"the last {trial_count} trials of each run, taken in proportion to the threshold"
        if trial_count > 1
        else "the last trial of each run, taken in proportion to the threshold",
        misfit_note="Levels followed the answers, so the lowest points deviate somewhat from the curve even of a "
        "correct model.",
        run_caption="Level of every counted trial, chosen by Psi, with right and wrong answers; the line is the "
        "threshold, the mean of the posterior after the last answer.",
        d_prime_note="Levels follow the answers, so d' of the answers hardly depends on the cue.",
    )  # fmt: skip


def select_threshold_words(rule: StaircaseRule) -> ThresholdWords:
    """Select the words for a rule: those of the Psi method where the rule is Bayesian, else those of reversal means."""
    return _make_psi_words(rule) if rule.is_bayesian else REVERSAL_WORDS
