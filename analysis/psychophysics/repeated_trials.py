"""Warning about participants who often made presentations void: by repeats, pauses, leaving, or answers outside the
allowed time.

A void presentation is played again. A participant who makes presentations void when unsure therefore gains evidence
from several presentations, which biases the threshold downwards: in simulations with unlimited repeats by 1.9 to
4.8 dB.
"""

from collections.abc import Callable, Sequence

from analysis.wording import conjoin
from protocols.trial import PARTICIPANT_CAUSES, Phase, Trial

LEAST_VOID_COUNT = 3
"""Least number of void presentations, of a run or a participant, that gives a warning."""
LEAST_VOID_SHARE = 0.02
"""Least share of void presentations that gives a warning. Chosen with `LEAST_VOID_COUNT`: accidents may void one or two
of some 60 presentations of a run; three of at most 150 are taken for a habit."""
VOID_LIMITS_TEXT = f"at least {LEAST_VOID_COUNT}, and at least {100 * LEAST_VOID_SHARE:g} % of them"
"""The two limits in words, for the warning and the report."""


def has_frequent_voids(void_count: int, presentation_count: int) -> bool:
    """Whether the void presentations are at least `LEAST_VOID_COUNT` in number and at least the share
    `LEAST_VOID_SHARE` of all presentations."""
    return void_count >= LEAST_VOID_COUNT and void_count >= LEAST_VOID_SHARE * presentation_count


def format_repeat_warning(trials: Sequence[Trial]) -> str:
    """Format a sentence that lists the participants (over all their runs) and the runs with frequent void
    presentations; empty where there are none. Training trials are not counted."""
    tested_trials = [trial for trial in trials if trial.phase is not Phase.TRAINING]
    participant_texts = _list_frequent_repeats(tested_trials, lambda trial: trial.subject)
    run_texts = _list_frequent_repeats(
        tested_trials, lambda trial: f"{trial.subject} at {trial.frequency_hz:g} Hz ({trial.session})"
    )
    if not participant_texts and not run_texts:
        return ""
    return (
        f"Trials were often made void at will ({VOID_LIMITS_TEXT}: asked for again, paused, left, answered outside the "
        "time). Each gives another presentation of an uncertain stimulus, so thresholds may be too low by some dB: "
        f"{conjoin([*participant_texts, *run_texts])}."
    )


def _list_frequent_repeats(trials: Sequence[Trial], get_group_name: Callable[[Trial], str]) -> list[str]:
    """List a text for each group of trials in which void presentations are frequent."""
    voids_by_group: dict[str, list[bool]] = {}
    for trial in trials:
        voids_by_group.setdefault(get_group_name(trial), []).append(trial.void_cause in PARTICIPANT_CAUSES)
    return [
        f"{group_name} {sum(is_void)} of {len(is_void)} presentations ({100 * sum(is_void) / len(is_void):.1f} %)"
        for group_name, is_void in voids_by_group.items()
        if has_frequent_voids(sum(is_void), len(is_void))
    ]
