"""Starting values for a clock that runs wrong, where a recording is too short to see lateness grow: by trial."""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.errors.hypothesis import Claim, Hypothesis, claimed
from equalizer.effects.clock_drift import LARGEST_PPM
from equalizer.effects.effect import ALL_SITES, Effect
from equalizer.effects.evidence import Evidence
from equalizer.effects.other_times import read_other_times
from equalizer.signals.signal import FloatArray

NAME = "clock_drift"
OF_A_PERIOD, MOST_TRIED = 6, 120
"""Trials differ at the recording's end by such a part of a period of the frequency below which half of the response's
power lies; and how many there are, either way."""
LEAST_SHARE = 1e-3
"""Of the misfit, that a trial must take."""


def clock_drift_by_trial(catalogue: Sequence[Effect], evidence: Evidence) -> tuple[Hypothesis, ...]:
    """None where the effect's own estimator finds some, where it may not be named, or where no trial is better."""
    effect = next((one for one in catalogue if one.name == NAME), None)
    if effect is None or effect.starts(evidence, ALL_SITES):
        return ()
    ppm = _best(evidence)
    p = evidence.response.shape[1]
    claim = Claim(effect, "all" if p > 1 else "one", tuple(range(p)))
    return tuple(
        claimed(claim, [{"ppm": ppm, "interpolated": straight, "with_position": 1.0}])
        for straight in (0.0, 1.0)
        if ppm != 0
    )


def _best(evidence: Evidence) -> float:
    """0 where nothing is better than no drift."""
    used, noise = evidence.used > 0, evidence.noise
    n, step = len(used), _period(evidence) / OF_A_PERIOD
    furthest = min(int(1e-6 * LARGEST_PPM * n / step), MOST_TRIED)
    tried = 1e6 * step / n * np.arange(-furthest, furthest + 1)

    def left(ppm: float) -> float:
        read = read_other_times(evidence.predicted, 1 + 1e-6 * ppm, 0.0, 0.0)
        return float(np.sum((((evidence.response - read) / noise) ** 2)[used]))

    misfits = [left(float(ppm)) for ppm in tried]
    best = int(np.argmin(misfits))
    return float(tried[best]) if misfits[best] < (1 - LEAST_SHARE) * misfits[furthest] else 0.0


def _period(evidence: Evidence) -> float:
    """Samples."""
    moving: FloatArray = (evidence.predicted - evidence.predicted.mean(axis=0)) / evidence.noise
    power = np.cumsum(np.sum(np.abs(np.fft.rfft(moving, axis=0)) ** 2, axis=1))
    return len(moving) / max(int(np.searchsorted(power, power[-1] / 2)), 1)
