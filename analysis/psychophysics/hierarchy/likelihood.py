"""Log-likelihood of each person's answers, with gradient, Hessian and expected (Fisher) information.

Per cell of answers at one level and direction:
    P(right) = lapse + (1 - 2 lapse) Phi(q(t) - side c),      t = t0 + exp(b) ln(10)/20 (level - theta).
A person has the latent parameters z = (theta_1 ... theta_k, b, c): a threshold per frequency in dB, the logarithm of
the slope, and the criterion in units of d'. side is +1 for direction 1 and -1 for direction 2; q and t0 are those of
`curve`. Answers are binomial. Derivatives are exact, by the chain rule over t, b and c.
"""

import math
from dataclasses import dataclass

import numpy as np

from analysis.psychophysics.hierarchy.answers import Answers
from analysis.psychophysics.hierarchy.curve import AT_THRESHOLD, NEPER_PER_DB, Family, sensitivity, share_right
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
    """(n, d, d): Fisher information at the levels played; positive semidefinite, unlike minus the Hessian."""
    by_lapse: FloatArray
    """(n,): derivative of the value by the lapse rate."""
    first_by_lapse: FloatArray
    """(n, d): derivative of the gradient by the lapse rate."""


class TrialLikelihood:
    """Log-likelihood of a study's answers at given latent parameters. The indices of runs and persons are prepared
    once."""

    def __init__(self, answers: Answers, family: Family) -> None:
        self.answers, self.family = answers, family
        self.persons, self.frequencies = answers.persons, len(answers.frequencies_hz)
        self._person = answers.person
        self._starts = np.flatnonzero(np.diff(answers.run, prepend=-1))
        self._runs = answers.run[self._starts]

    def evaluate(self, latent: FloatArray, lapse: float) -> Derivatives:
        """Values and derivatives at latent parameters (n, k + 2) and this lapse rate."""
        side, pace = self.answers.side, np.exp(latent[:, self.frequencies]) * NEPER_PER_DB
        tau, a, q1, q2 = self._evidence(latent, pace)
        e = _Evidence(a, self.answers.right, self.answers.wrong, lapse)
        u, u1 = e.score, e.score_by_p
        slope, curvature = u * e.p1, u1 * e.p1**2 - u * a * e.p1
        lapsed = u1 * e.p_by_lapse * e.p1 + u * e.p1_by_lapse
        lt, ltt, ltc = slope * q1, curvature * q1**2 + slope * q2, -side * curvature * q1
        bent, wtt, wtc = ltt * tau + lt, e.weight * q1**2, -side * e.weight * q1
        lapsed_t = lapsed * q1
        sums = self._sum_by_run([
            e.value, u * e.p_by_lapse,
            lt, lt * tau, -side * slope,
            lapsed_t, lapsed_t * tau, -side * lapsed,
            ltt, bent, ltc, bent * tau, ltc * tau, curvature,
            wtt, wtt * tau, wtc, wtt * tau**2, wtc * tau, e.weight,
        ])  # fmt: skip
        p = pace[:, None]
        return Derivatives(
            value=sums[0].sum(axis=1),
            first=_gradient(sums[2:5], p),
            second=_hessian(sums[8:14], p),
            information=_hessian(sums[14:20], p),
            by_lapse=sums[1].sum(axis=1),
            first_by_lapse=_gradient(sums[5:8], p),
        )

    def trace_derivatives(self, latent: FloatArray, lapse: float, inverse: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Trace of `inverse` (n, d, d) times the derivative of the information by each latent parameter (n, d), and by
        the lapse rate (n,)."""
        k, run, person = self.frequencies, self.answers.run, self._person
        pace = np.exp(latent[:, k]) * NEPER_PER_DB
        tau, a, q1, q2 = self._evidence(latent, pace)
        e = _Evidence(a, self.answers.right, self.answers.wrong, lapse)
        p, places = pace[person], np.arange(k)
        at, ab, ac = -p * q1, tau * q1, -self.answers.side
        att, atb, abb = p**2 * q2, -p * (q2 * tau + q1), (q2 * tau + q1) * tau
        tt, tb, tc = (inverse[:, places, other].ravel()[run] for other in (places, k, k + 1))
        bb, bc, cc = (inverse[:, i, j][person] for i, j in ((k, k), (k, k + 1), (k + 1, k + 1)))
        vt, vb = tt * at + tb * ab + tc * ac, tb * at + bb * ab + bc * ac
        size = at * vt + ab * vb + ac * (tc * at + bc * ab + cc * ac)
        grown = e.weight * (-2.0 * a - e.p1 / e.p + e.p1 / e.rest) * size
        lapsed = e.weight * (-4.0 / (1.0 - 2.0 * lapse) - e.p_by_lapse / e.p + e.p_by_lapse / e.rest) * size
        w = 2.0 * e.weight
        sums = self._sum_by_run([
            grown * at + w * (vt * att + vb * atb), grown * ab + w * (vt * atb + vb * abb), grown * ac, lapsed
        ])  # fmt: skip
        own, rest = sums[0], sums[1:].sum(axis=2)
        return np.concatenate([own, rest[:2].T], axis=1), rest[2]

    def _evidence(self, latent: FloatArray, pace: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Per cell (m,): t - t0, mean of the evidence q - side c, and the first two derivatives of q by t."""
        cells, k = self.answers, self.frequencies
        tau = pace[self._person] * (cells.level_db - latent[:, :k].ravel()[cells.run])
        q, q1, q2 = sensitivity(AT_THRESHOLD[self.family] + tau, self.family)
        return tau, q - cells.side * latent[:, k + 1][self._person], q1, q2

    def _sum_by_run(self, rows: list[FloatArray]) -> FloatArray:
        """Sums over the cells of each run: (rows, n, k); 0 where a person has no answer at a frequency."""
        summed = np.zeros((len(rows), self.persons * self.frequencies))
        summed[:, self._runs] = np.add.reduceat(np.array(rows), self._starts, axis=1)
        return summed.reshape(len(rows), self.persons, self.frequencies)


class _Evidence:
    """P(right) = p(a) per cell (m,) at the evidence a, with derivatives by a (`p1`) and by the lapse rate; the
    log-likelihood, its derivatives by p, and the Fisher information by a (`weight`)."""

    def __init__(self, a: FloatArray, right: FloatArray, wrong: FloatArray, lapse: float) -> None:
        density, attentive = np.exp(-(a**2) / 2) / math.sqrt(2.0 * math.pi), 1.0 - 2.0 * lapse
        self.p = share_right(a, lapse)
        self.rest = 1.0 - self.p
        self.p1 = attentive * density
        # 1 - 2 Phi(a), because 1 - 2 p = (1 - 2 lapse) (1 - 2 Phi(a)).
        self.p_by_lapse, self.p1_by_lapse = (1.0 - 2.0 * self.p) / attentive, -2.0 * density
        self.value = right * np.log(self.p) + wrong * np.log(self.rest)
        self.score = right / self.p - wrong / self.rest
        self.score_by_p = -right / self.p**2 - wrong / self.rest**2
        self.weight = (right + wrong) * self.p1**2 / (self.p * self.rest)


def _gradient(sums: FloatArray, pace: FloatArray) -> FloatArray:
    """Gradient (n, d) from sums over cells (3, n, k) of derivatives by t, b and c. pace: -dt/dtheta (n, 1)."""
    return np.concatenate([-pace * sums[0], sums[1:].sum(axis=2).T], axis=1)


def _hessian(sums: FloatArray, pace: FloatArray) -> FloatArray:
    """Hessian (n, d, d) from sums over cells (6, n, k) of second derivatives by tt, tb, tc, bb, bc, cc. pace: as in
    `_gradient`."""
    _, n, k = sums.shape
    out = np.zeros((n, k + 2, k + 2))
    places = np.arange(k)
    out[:, places, places] = pace**2 * sums[0]
    for other in (0, 1):
        out[:, places, k + other] = out[:, k + other, places] = -pace * sums[1 + other]
    bb, bc, cc = sums[3:].sum(axis=2)
    out[:, k, k], out[:, k + 1, k + 1] = bb, cc
    out[:, k, k + 1] = out[:, k + 1, k] = bc
    return out
