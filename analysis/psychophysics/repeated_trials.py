"""Warning for participants who often made presentations void: by repeats, pauses, leaving, or answers out of time.

A void presentation is played again, so that a participant who makes trials void when unsure has more evidence than a
single presentation gives, and a threshold that is too low. In simulations this lowered thresholds by up to 2 dB under
the first rules of a session, which drew a new stimulus for the repeat. Now the same stimulus is repeated. The repeat
key is limited, but pauses and leaving are not; without a limit the repeats lowered simulated thresholds by 1.9 to
4.8 dB.
"""

from collections.abc import Callable, Sequence

from analysis.wording import conjoin
from protocols.trial import PARTICIPANT_CAUSES, Phase, Trial

OFTEN_COUNT = 3
"""Fewest void presentations, of a run or a participant, that give a warning."""
OFTEN_RATE = 0.02
"""Least share of void presentations that gives a warning. A cough or a noise may spoil one or two of some 60
presentations of a run; three of at most 150 are taken for a habit."""
OFTEN_WORDS = f"at least {OFTEN_COUNT}, and at least {100 * OFTEN_RATE:g} % of them"


def is_often(repeats: int, presentations: int) -> bool:
    """Whether the repeats are at least `OFTEN_COUNT` in number and at least the share `OFTEN_RATE` of presentations."""
    return repeats >= OFTEN_COUNT and repeats >= OFTEN_RATE * presentations


def repeat_warning(trials: Sequence[Trial]) -> str:
    """Sentence that names the runs, and the participants over all their runs, with too many void presentations; empty
    without any. Training is left out."""
    tested = [trial for trial in trials if trial.phase is not Phase.TRAINING]
    people = _frequent_repeats(tested, lambda trial: trial.subject)
    runs = _frequent_repeats(tested, lambda trial: f"{trial.subject} at {trial.frequency_hz:g} Hz ({trial.session})")
    if not people and not runs:
        return ""
    return (
        f"Trials were often made void at will ({OFTEN_WORDS}: asked for again, paused, left, answered outside the "
        "time). Each gives another presentation of an uncertain stimulus, so thresholds may be too low by some dB: "
        f"{conjoin([*people, *runs])}."
    )


def _frequent_repeats(trials: Sequence[Trial], name_of: Callable[[Trial], str]) -> list[str]:
    """Text for each group of trials of the same name in which presentations were often made void at will."""
    void_by_name: dict[str, list[bool]] = {}
    for trial in trials:
        void_by_name.setdefault(name_of(trial), []).append(trial.void_cause in PARTICIPANT_CAUSES)
    return [
        f"{name} {sum(is_void)} of {len(is_void)} presentations ({100 * sum(is_void) / len(is_void):.1f} %)"
        for name, is_void in void_by_name.items()
        if is_often(sum(is_void), len(is_void))
    ]
