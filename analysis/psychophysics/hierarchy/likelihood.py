"""Log-likelihood of each person's answers, with gradient, Hessian and expected (Fisher) information.

Per cell of answers at one level and direction:
    P(right) = lapse + (1 - 2 lapse) Phi(q(t) - side c),      t = t0 + exp(b) ln(10)/20 (level - theta).
A person has the latent parameters z = (theta_1 ... theta_k, b, c): a threshold per frequency in dB, the logarithm of
the slope, and the criterion in units of d'. side is +1 for direction 1 and -1 for direction 2; q and t0 are those of
`curve`. Answers are binomial. Derivatives are exact, by the chain rule over t, b and c.

Names of derivatives: slope_per_db = -dt/dtheta = dt/dlevel, tau = t - t0 = dt/db, a = q(t) - side c (the evidence); q1,
q2: dq/dt and its derivative; p1: dp/da. Of the log-likelihood l: u = dl/dp, u1 = du/dp, lt = dl/dt; ltt, ltb, ltc:
second derivatives by t, b and c; wtt, wtc: minus their expected values. In `trace_derivatives`, a_t, a_b, a_c and a_tt,
a_tb, a_bb are derivatives of a by theta, b and c, and v_tt to v_cc the entries of the given inverse.
"""

import math
from dataclasses import dataclass

import numpy as np

from analysis.psychophysics.hierarchy.answers import Answers
from analysis.psychophysics.hierarchy.curve import (
    NEPER_PER_DB,
    T_AT_THRESHOLD,
    Family,
    compute_proportion_correct,
    differentiate_evidence,
)
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Derivatives:
    """Log-likelihood of n persons, with derivatives by their d = k + 2 latent parameters and by the lapse rate."""

    value: FloatArray
    """(n,): log-likelihood, without the binomial coefficients."""
    first: FloatArray
    """(n, d): gradient."""
    second: FloatArray
    """(n, d, d): Hessian."""
    information: FloatArray
    """(n, d, d): Fisher information at the levels played; always positive semidefinite, unlike the negative Hessian."""
    lapse_derivative: FloatArray
    """(n,): derivative of the value by the lapse rate."""
    gradient_lapse_derivative: FloatArray
    """(n, d): derivative of the gradient by the lapse rate."""


class TrialLikelihood:
    """Log-likelihood of a study's answers at given latent parameters."""

    def __init__(self, answers: Answers, family: Family) -> None:
        self.answers, self.family = answers, family
        self.persons, self.frequencies = answers.persons, len(answers.frequencies_hz)
        self._person = answers.person
        self._starts = np.flatnonzero(np.diff(answers.run, prepend=-1))
        self._runs = answers.run[self._starts]

    def evaluate(self, latent: FloatArray, lapse: float) -> Derivatives:
        """Evaluate values and derivatives at latent parameters (n, k + 2) and this lapse rate."""
        side, slope_per_db = self.answers.side, np.exp(latent[:, self.frequencies]) * NEPER_PER_DB
        tau, a, q1, q2 = self._compute_evidence(latent, slope_per_db)
        e = _Evidence(a, self.answers.right, self.answers.wrong, lapse)
        u, u1 = e.score, e.score_by_p
        slope, curvature = u * e.p1, u1 * e.p1**2 - u * a * e.p1
        slope_by_lapse = u1 * e.p_by_lapse * e.p1 + u * e.p1_by_lapse
        lt, ltt, ltc = slope * q1, curvature * q1**2 + slope * q2, -side * curvature * q1
        ltb, wtt, wtc = ltt * tau + lt, e.weight * q1**2, -side * e.weight * q1
        lt_by_lapse = slope_by_lapse * q1
        sums = self._sum_by_run([
            e.value, u * e.p_by_lapse,
            lt, lt * tau, -side * slope,
            lt_by_lapse, lt_by_lapse * tau, -side * slope_by_lapse,
            ltt, ltb, ltc, ltb * tau, ltc * tau, curvature,
            wtt, wtt * tau, wtc, wtt * tau**2, wtc * tau, e.weight,
        ])  # fmt: skip
        slope_column = slope_per_db[:, None]
        return Derivatives(
            value=sums[0].sum(axis=1),
            first=_assemble_gradient(sums[2:5], slope_column),
            second=_assemble_hessian(sums[8:14], slope_column),
            information=_assemble_hessian(sums[14:20], slope_column),
            lapse_derivative=sums[1].sum(axis=1),
            gradient_lapse_derivative=_assemble_gradient(sums[5:8], slope_column),
        )

    def trace_derivatives(self, latent: FloatArray, lapse: float, inverse: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute the trace of `inverse` (n, d, d) times the derivative of the information by each latent parameter (n,
        d), and by the lapse rate (n,)."""
        k, run, person = self.frequencies, self.answers.run, self._person
        slope_per_db = np.exp(latent[:, k]) * NEPER_PER_DB
        tau, a, q1, q2 = self._compute_evidence(latent, slope_per_db)
        e = _Evidence(a, self.answers.right, self.answers.wrong, lapse)
        cell_slope, index = slope_per_db[person], np.arange(k)
        a_t, a_b, a_c = -cell_slope * q1, tau * q1, -self.answers.side
        a_tt, a_tb, a_bb = cell_slope**2 * q2, -cell_slope * (q2 * tau + q1), (q2 * tau + q1) * tau
        v_tt, v_tb, v_tc = (inverse[:, index, column].ravel()[run] for column in (index, k, k + 1))
        v_bb, v_bc, v_cc = (inverse[:, i, j][person] for i, j in ((k, k), (k, k + 1), (k + 1, k + 1)))
        vt, vb = v_tt * a_t + v_tb * a_b + v_tc * a_c, v_tb * a_t + v_bb * a_b + v_bc * a_c
        variance = a_t * vt + a_b * vb + a_c * (v_tc * a_t + v_bc * a_b + v_cc * a_c)
        by_evidence = e.weight * (-2.0 * a - e.p1 / e.p + e.p1 / e.wrong_p) * variance
        by_lapse = e.weight * (-4.0 / (1.0 - 2.0 * lapse) - e.p_by_lapse / e.p + e.p_by_lapse / e.wrong_p) * variance
        w = 2.0 * e.weight
        sums = self._sum_by_run([
            by_evidence * a_t + w * (vt * a_tt + vb * a_tb), by_evidence * a_b + w * (vt * a_tb + vb * a_bb),
            by_evidence * a_c, by_lapse
        ])  # fmt: skip
        by_threshold, by_shared = sums[0], sums[1:].sum(axis=2)
        return np.concatenate([by_threshold, by_shared[:2].T], axis=1), by_shared[2]

    def _compute_evidence(
        self, latent: FloatArray, slope_per_db: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Compute per cell (m,): t - t0, the evidence q - side c, and the first two derivatives of q by t.
        slope_per_db: (n,)."""
        cells, k = self.answers, self.frequencies
        tau = slope_per_db[self._person] * (cells.level_db - latent[:, :k].ravel()[cells.run])
        q, q1, q2 = differentiate_evidence(T_AT_THRESHOLD[self.family] + tau, self.family)
        return tau, q - cells.side * latent[:, k + 1][self._person], q1, q2

    def _sum_by_run(self, rows: list[FloatArray]) -> FloatArray:
        """Sum rows of (m,) over the cells of each run: (rows, n, k); 0 where a person has no answer at a frequency."""
        totals = np.zeros((len(rows), self.persons * self.frequencies))
        totals[:, self._runs] = np.add.reduceat(np.array(rows), self._starts, axis=1)
        return totals.reshape(len(rows), self.persons, self.frequencies)


class _Evidence:
    """P(right) = p(a) per cell (m,) at the evidence a, with derivatives by a (`p1`) and by the lapse rate; the
    log-likelihood, its derivatives by p, and the Fisher information by a (`weight`)."""

    def __init__(self, a: FloatArray, right: FloatArray, wrong: FloatArray, lapse: float) -> None:
        density, attentive = np.exp(-(a**2) / 2) / math.sqrt(2.0 * math.pi), 1.0 - 2.0 * lapse
        self.p = compute_proportion_correct(a, lapse)
        self.wrong_p = 1.0 - self.p
        self.p1 = attentive * density
        # 1 - 2 Phi(a), because 1 - 2 p = (1 - 2 lapse) (1 - 2 Phi(a)).
        self.p_by_lapse, self.p1_by_lapse = (1.0 - 2.0 * self.p) / attentive, -2.0 * density
        self.value = right * np.log(self.p) + wrong * np.log(self.wrong_p)
        self.score = right / self.p - wrong / self.wrong_p
        self.score_by_p = -right / self.p**2 - wrong / self.wrong_p**2
        self.weight = (right + wrong) * self.p1**2 / (self.p * self.wrong_p)


def _assemble_gradient(sums: FloatArray, slope_per_db: FloatArray) -> FloatArray:
    """Assemble the gradient (n, d) from sums over cells (3, n, k) of derivatives by t, b and c. slope_per_db:
    -dt/dtheta (n, 1)."""
    return np.concatenate([-slope_per_db * sums[0], sums[1:].sum(axis=2).T], axis=1)


def _assemble_hessian(sums: FloatArray, slope_per_db: FloatArray) -> FloatArray:
    """Assemble the Hessian (n, d, d) from sums over cells (6, n, k) of second derivatives by tt, tb, tc, bb, bc, cc.
    slope_per_db: as in `_assemble_gradient`."""
    _, n, k = sums.shape
    hessian = np.zeros((n, k + 2, k + 2))
    index = np.arange(k)
    hessian[:, index, index] = slope_per_db**2 * sums[0]
    for shared in (0, 1):
        hessian[:, index, k + shared] = hessian[:, k + shared, index] = -slope_per_db * sums[1 + shared]
    bb, bc, cc = sums[3:].sum(axis=2)
    hessian[:, k, k], hessian[:, k + 1, k + 1] = bb, cc
    hessian[:, k, k + 1] = hessian[:, k + 1, k] = bc
    return hessian
