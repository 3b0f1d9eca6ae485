"""Participants who often made presentations void: by repeats, pauses, leaving, or answers outside the time.

A second look helps a participant who looks again when unsure. Under the first rules of a session, which drew a new
stimulus, it moved thresholds by up to -2 dB. Now the same stimulus comes again and the repeat key is limited; pauses
and leaving are not, and without a limit second looks moved simulated thresholds by -1.9 to -4.8 dB. So a flag means
that a threshold may be too low, not only that trials took longer.
"""

from collections.abc import Callable, Sequence

from analysis.wording import conjoin
from protocols.trial import AT_WILL, Phase, Trial

OFTEN_COUNT = 3
"""Fewest repeats of a run's trials that give a warning."""
OFTEN_RATE = 0.02
"""A cough or a noise comes once or twice in a run of some 60 presentations. Three, of at most 150, are a habit."""
OFTEN_WORDS = f"at least {OFTEN_COUNT}, and at least {100 * OFTEN_RATE:g} % of them"


def is_often(repeats: int, presentations: int) -> bool:
    """Whether repeats are at least `OFTEN_COUNT`, and at least the share `OFTEN_RATE` of the presentations."""
    return repeats >= OFTEN_COUNT and repeats >= OFTEN_RATE * presentations


def repeat_warning(trials: Sequence[Trial]) -> str:
    """Runs, and participants over all their runs, that are beyond the limit; training is left out. Empty for none."""
    tested = [trial for trial in trials if trial.phase is not Phase.TRAINING]
    people = _frequent_repeats(tested, lambda trial: trial.subject)
    runs = _frequent_repeats(tested, lambda trial: f"{trial.subject} at {trial.frequency_hz:g} Hz ({trial.session})")
    if not people and not runs:
        return ""
    return (
        f"Trials were often made void at will ({OFTEN_WORDS}: asked for again, paused, left, answered outside the "
        f"time). Each gives another look at what was unsure, so that thresholds may be too low by some dB: "
        f"{conjoin([*people, *runs])}."
    )


def _frequent_repeats(trials: Sequence[Trial], name_of: Callable[[Trial], str]) -> list[str]:
    void: dict[str, list[bool]] = {}
    for trial in trials:
        void.setdefault(name_of(trial), []).append(trial.void_cause in AT_WILL)
    return [
        f"{name} {sum(made)} of {len(made)} presentations ({100 * sum(made) / len(made):.1f} %)"
        for name, made in void.items()
        if is_often(sum(made), len(made))
    ]
