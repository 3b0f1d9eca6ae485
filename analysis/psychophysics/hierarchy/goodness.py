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
    differentiate_evidence,
)
from analysis.psychophysics.hierarchy.fit import HierarchicalFit
from equalizer.signals.signal import FloatArray

BIN_COUNT = 8
"""Largest number of bins, with about equal numbers of trials. Chosen."""


@dataclass(frozen=True, slots=True)
class ShareBin:
    """Predicted and observed share of right answers in a bin of trials with similar predictions."""

    trials: int
    """Number of trials in the bin."""
    predicted: float
    """Mean predicted share, 0 to 1."""
    observed: float
    """Right answers over trials, 0 to 1."""
    z: float
    """(observed - predicted) over its binomial standard error."""


@dataclass(frozen=True, slots=True)
class GoodnessOfFit:
    """Observed and predicted shares in bins. There is no p-value: the staircase sets each level by the answers before,
    and each person's parameters were fitted to the same answers, so that the observed shares of the lowest bins tend to
    be too low even for a correct model."""

    bins: tuple[ShareBin, ...]
    """In ascending order of the predicted share."""


def compute_goodness_of_fit(fit: HierarchicalFit) -> GoodnessOfFit:
    """Compute the shares in at most `BIN_COUNT` bins. All trials of a cell (one run, level and direction) are in the
    same bin."""
    predicted_shares, answers = predict_shares(fit), fit.answers
    trial_counts = answers.right + answers.wrong
    cell_order = np.argsort(predicted_shares, kind="stable")
    bin_index = np.minimum(
        (np.cumsum(trial_counts[cell_order]) - 0.5) / trial_counts.sum() * BIN_COUNT, BIN_COUNT - 1
    ).astype(int)
    bins = []
    for index in range(BIN_COUNT):
        bin_cells = cell_order[bin_index == index]
        if len(bin_cells):
            cell_trials, cell_correct, cell_shares = (
                trial_counts[bin_cells],
                answers.right[bin_cells],
                predicted_shares[bin_cells],
            )
            expected_correct, standard_error = (
                float(cell_trials @ cell_shares),
                float(np.sqrt(cell_trials @ (cell_shares * (1.0 - cell_shares)))),
            )
            bins.append(
                ShareBin(
                    int(cell_trials.sum()),
                    expected_correct / float(cell_trials.sum()),
                    float(cell_correct.sum() / cell_trials.sum()),
                    (float(cell_correct.sum()) - expected_correct) / standard_error,
                )
            )
    return GoodnessOfFit(tuple(bins))


def predict_shares(fit: HierarchicalFit) -> FloatArray:
    """Predict the probability (m,) of a right answer in each cell of `fit.answers`, with the person's own threshold,
    slope and criterion: lapse + (1 - 2 lapse) Phi(q(t) - side criterion), t = t0 + slope ln(10)/20 (level -
    threshold)."""
    answers, frequency_count = fit.answers, fit.layout.k
    person = answers.person
    slope_per_db = np.exp(fit.latent[person, frequency_count]) * NEPER_PER_DB
    t = T_AT_THRESHOLD[fit.family] + slope_per_db * (
        answers.level_db - fit.latent[:, :frequency_count].ravel()[answers.run]
    )
    return compute_proportion_correct(
        differentiate_evidence(t, fit.family)[0] - answers.side * fit.latent[person, frequency_count + 1], fit.lapse
    )
