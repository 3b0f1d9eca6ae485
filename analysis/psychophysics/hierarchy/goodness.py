"""Goodness of fit of the hierarchical psychometric model: predicted against observed shares of right answers.

Trials are binned by their predicted share (calibration plot); per bin, z = (observed - predicted) / standard error,
with the binomial variance sum of n p (1 - p). Equations of p: `curve`.
"""

from dataclasses import dataclass

import numpy as np

from analysis.psychophysics.hierarchy.curve import (
    NEPER_PER_DB,
    T_AT_THRESHOLD,
    compute_proportion_correct,
    compute_sensitivity,
)
from analysis.psychophysics.hierarchy.fit import HierarchicalFit
from equalizer.signals.signal import FloatArray

BINS = 8
"""Number of bins with equal numbers of trials: about 400 trials each in a study of ten participants."""


@dataclass(frozen=True, slots=True)
class ShareBin:
    """Predicted and observed share of right answers in a bin of trials with similar predictions."""

    trials: int
    """Number of trials in the bin."""
    predicted: float
    observed: float
    z: float
    """(observed - predicted) over its binomial standard error."""


@dataclass(frozen=True, slots=True)
class GoodnessOfFit:
    """Observed and predicted shares in bins. There is no p-value: the staircase sets each level by the answers before,
    and each person's parameters were fitted to the same answers, so that the observed shares of the lowest bins are
    some standard errors too low although the model is right. Only a systematic pattern over the bins indicates
    misfit."""

    bins: tuple[ShareBin, ...]


def goodness_of_fit(fit: HierarchicalFit) -> GoodnessOfFit:
    """Shares in at most `BINS` bins of about equally many trials, in ascending order of the predicted share."""
    share, cells = predict_shares(fit), fit.answers
    trials = cells.right + cells.wrong
    order = np.argsort(share, kind="stable")
    bin_index = np.minimum((np.cumsum(trials[order]) - 0.5) / trials.sum() * BINS, BINS - 1).astype(int)
    bins = []
    for index in range(BINS):
        in_bin = order[bin_index == index]
        if len(in_bin):
            n, correct, p = trials[in_bin], cells.right[in_bin], share[in_bin]
            expected, standard_error = float(n @ p), float(np.sqrt(n @ (p * (1.0 - p))))
            bins.append(
                ShareBin(
                    int(n.sum()),
                    expected / float(n.sum()),
                    float(correct.sum() / n.sum()),
                    (float(correct.sum()) - expected) / standard_error,
                )
            )
    return GoodnessOfFit(tuple(bins))


def predict_shares(fit: HierarchicalFit) -> FloatArray:
    """(m,): probability of a right answer in each cell of `fit.answers`, with the person's own threshold, slope and
    criterion: lapse + (1 - 2 lapse) Phi(q(t) - side criterion), t = t0 + slope ln(10)/20 (level - threshold)."""
    cells, k = fit.answers, fit.layout.k
    person = cells.person
    pace = np.exp(fit.latent[person, k]) * NEPER_PER_DB
    t = T_AT_THRESHOLD[fit.family] + pace * (cells.level_db - fit.latent[:, :k].ravel()[cells.run])
    return compute_proportion_correct(
        compute_sensitivity(t, fit.family)[0] - cells.side * fit.latent[person, k + 1], fit.lapse
    )
