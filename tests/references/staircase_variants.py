"""What the open choices of the staircase do to a threshold. `python tests/references/staircase_variants.py` prints it.

Simulated Weibull observers, far below the cap, start 10 dB above their threshold; bias against the level at which
79.4 % are right. The numbers in the protocol files and in `protocols.definition.staircase_rule` are from this table.
"""

import math
import sys

import numpy as np

from protocols.definition.staircase_rule import StaircaseRule, StepChange, StepPhase
from protocols.procedure.staircase import begin_staircase, compute_level_n, is_finished, step, to_newton

TRUE_DB = -10.0
TARGET = 0.5 ** (1 / 3)


def rule(change: StepChange, initial: bool = False) -> StaircaseRule:
    phases = (StepPhase(4.0, 3), StepPhase(1.0, 10))
    return StaircaseRule(1.0, 3.0, 1, 3, phases, 13, 10, step_change=change, initial_one_up_one_down=initial)


def thresholds_db(rule: StaircaseRule, slope: float, lapse: float, runs: int, seed: int) -> np.ndarray:
    """Mean dB of the last ten reversals of each run. shape (runs,)"""
    rng = np.random.default_rng(seed)
    at_target = (-math.log(1 - (TARGET - 0.5) / (0.5 - lapse))) ** (1 / slope)
    alpha_n = to_newton(TRUE_DB) / at_target
    results = []
    for _ in range(runs):
        state = begin_staircase(rule)
        while not is_finished(rule, state):
            p = 0.5 + (0.5 - lapse) * -math.expm1(-((compute_level_n(rule, state) / alpha_n) ** slope))
            state = step(rule, state, bool(rng.random() < p))
        results.append(np.mean(state.reversal_levels_db[-10:]))
    return np.array(results)


VARIANTS = {
    "after_reversal": rule(StepChange.AFTER_REVERSAL),
    "at_reversal": rule(StepChange.AT_REVERSAL),
    "at_next_reversal": rule(StepChange.AT_NEXT_REVERSAL),
    "after_reversal, initial 1-up-1-down": rule(StepChange.AFTER_REVERSAL, initial=True),
}


def main() -> None:
    for slope, lapse in ((1.5, 0.0), (2.0, 0.0), (2.0, 0.05), (3.5, 0.0)):
        for name, variant in VARIANTS.items():
            found = thresholds_db(variant, slope, lapse, runs=600, seed=1) - TRUE_DB
            line = f"slope {slope:.1f}, lapse {lapse:.2f}, {name:36}"
            sys.stdout.write(f"{line} bias {found.mean():+.2f} dB, sd {found.std():.2f} dB\n")


if __name__ == "__main__":
    main()
