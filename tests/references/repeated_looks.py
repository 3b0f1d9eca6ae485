"""What a participant gains who asks for the same trial again when unsure. `python tests/references/repeated_looks.py`
prints the figures of docs/statistics.md.

One run at 15 Hz under the published staircase, of `repeating` and of `ideal` with the same seeds, device-free; the
shipped protocols allow three repeats in a run.
"""

import math
import sys

import numpy as np

from protocols.definition.staircase_rule import StaircaseRule, StepPhase
from protocols.procedure.staircase import begin_staircase, compute_level_n, is_finished, step
from protocols.trial import Phase
from study.participants.observer import PerceivedStimulus
from study.participants.observer_catalogue import find_observer

RULE = StaircaseRule(1.0, 3.0, 1, 3, (StepPhase(4.0, 3), StepPhase(1.0, 10)), 13, 10)
HZ, RUNS = 15.0, 150


def run(name: str, seed: int, most: float) -> tuple[float, int]:
    """Threshold in dB, the mean of the last ten reversals, and how often a trial was asked for again. most: repeats
    that are allowed."""
    observer, rng, state = find_observer(name, seed), np.random.default_rng([seed, 15]), begin_staircase(RULE)
    asked = 0
    while not is_finished(RULE, state):
        shown = int(rng.integers(1, 3))
        attempt = 0
        while True:
            felt = PerceivedStimulus(
                1, state.trials, attempt, Phase.TEST, HZ, compute_level_n(RULE, state), shown, state.trials
            )
            reply = observer.reply(felt, seed)
            if not reply.ask_again or asked >= most:
                break
            asked, attempt = asked + 1, attempt + 1
        state = step(RULE, state, reply.answer == shown)
    return float(np.mean(state.reversal_levels_db[-RULE.averaged_reversals :])), asked


def gain_db(most: float, runs: int) -> tuple[np.ndarray, float]:
    """By how much thresholds are lower than those of `ideal`, shape (runs,), and the mean number of repeats."""
    mine = [run("repeating", seed, most) for seed in range(runs)]
    plain = [run("ideal", seed, 0.0) for seed in range(runs)]
    return np.array([theirs[0] - ours[0] for theirs, ours in zip(plain, mine, strict=True)]), np.mean(
        [a for _, a in mine]
    )


def main(runs: int) -> None:
    for most in (3.0, math.inf):
        gained, asked = gain_db(most, runs)
        error = gained.std(ddof=1) / math.sqrt(runs)
        sys.stdout.write(f"at most {most:g}: {asked:.0f} repeats a run, {gained.mean():.2f} ± {error:.2f} dB lower\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else RUNS)
