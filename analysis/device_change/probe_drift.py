"""Drift of a device during a session: probes are compared line by line with the first ones, in physical parameters.

A line drives one axis j with the force F; all axes answer with accelerations A. With A0, F0 of the first probes at the
same level, and a mechanism that is reciprocal, its other properties cancel in

    (F A0_j - F0 A_j) / (A0_j A_j) = sum over k of (dM_k + dC_k / iw - dK_k / w^2) A0_k A_k / (A0_j A_j)
                                     - g_j F / A_j + iw T F / A_j + friction

dM, dC, dK: change of the hand's mass, damping and stiffness; g: relative change of the delivered force; T: added delay.
Friction: its shapes S (force of 1 N along the measured motion) times its change, dFc_k A0_k S_k / (A0_j A_j), and times
its value at first, because the shape changes with the motion. That value is estimated from the level dependence of the
first responses. The noise is estimated from the differences between the first probes of a level. Of all causes and
pairs of causes, those with the best penalised fit are selected.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import numpy.typing as npt

from analysis.device_change.probe_lines import ProbeLines, friction_shapes
from equalizer.signals.signal import ComplexArray, FloatArray

IntArray = npt.NDArray[np.int64]

AXES = "xyz"
BASE_CYCLES = 2
"""Number of probes at each level before anything is compared: their differences give the noise."""
COST = 8.0
"""Penalty per parameter, in units of the squared misfit over noise: more than twice Akaike's, against false alarms."""
MOST = 2
"""Causes at a time: with more of them, what friction does beyond its law is taken for hand and motor."""
SAME = 2.0
"""Ratio of squared misfits below which two causes cannot be distinguished. On the simulated omega.3 a hand that becomes
one and a half of what it was leaves 1.2 to 1.7 times what a gain leaves: friction is more there than its law."""
DELAY_STEPS = 3
"""Gauss-Newton steps for a delay, in which the response is not linear."""
DEVIATIONS = 4.0
"""Standard errors beyond which a number is more than the scatter."""

CAUSES = {"friction": ("friction",), "grip": ("mass", "damping", "stiffness"), "gain": ("gain",), "delay": ("delay",)}
NUMBERS = ("friction", "mass", "damping", "stiffness", "gain", "delay")
UNITS = {"friction": "N", "mass": "kg", "damping": "N s/m", "stiffness": "N/m", "gain": "", "delay": "s"}
LEAST = {"friction": 0.03, "mass": 0.01, "damping": 0.5, "stiffness": 15.0, "gain": 0.03, "delay": 3e-4}
"""Smaller changes do not matter: 3 % of a stimulus of 1 N, or a tenth of a light grip."""


@dataclass(frozen=True, slots=True, eq=False)
class TimedProbe:
    """One probe with a hand on the handle."""

    at_s: float
    """Time since the session began."""
    level_n: float
    lines: ProbeLines


@dataclass(frozen=True, slots=True)
class Drift:
    """One number that changed, at the time of the newest probe that was compared."""

    cause: str
    """friction, grip, gain or delay"""
    number: str
    """friction, mass, damping, stiffness, gain or delay"""
    axis: str
    at_s: float
    change: float
    error: float
    """Standard error."""
    before: float | None
    """Initial value of the friction; None where only the change is known."""
    rivals: tuple[str, ...] = ()
    """Causes that the probes cannot tell from this one."""

    @property
    def unit(self) -> str:
        """Unit of `change`, `error` and `before`; empty for a gain, whose change is relative."""
        return UNITS[self.number]


def drifts(probes: Sequence[TimedProbe], period: int, causes: Sequence[str] = tuple(CAUSES)) -> tuple[Drift, ...]:
    """Differences of the newest probe of each level from the first ones. Empty with too few probes. period: samples.
    Probes are ordered by time. causes: possible changes; without a hand no grip."""
    levels = sorted({probe.level_n for probe in probes})
    by_level = {level: [probe for probe in probes if probe.level_n == level] for level in levels}
    if not probes or min(len(found) for found in by_level.values()) < BASE_CYCLES + 1:
        return ()
    base = [probe for found in by_level.values() for probe in found[:BASE_CYCLES]]
    now = [found[-1] for found in by_level.values()]
    both = [*base, *now]
    shapes = friction_shapes(tuple(probe.lines for probe in both), period)
    of_each, at_s = np.array([probe.level_n for probe in both]), max(probe.at_s for probe in now)
    delay_s = 0.0
    for _ in range(DELAY_STEPS):  # a delay turns phases; its column is that for a small one
        compared = _compare(both, shapes, of_each, delay_s)
        found = tuple(_explain(compared, at_s, tuple(causes)))
        delay_s += sum(each.change for each in found if each.number == "delay")
    late = replace(_as_delay(compared, at_s), change=delay_s)
    kept = tuple(each for each in found if each.number != "delay")
    return (*kept, late) if abs(delay_s) > max(LEAST["delay"], DEVIATIONS * late.error) else kept


def _as_delay(compared: _Compared, at_s: float) -> Drift:
    """A delay as the only cause, for its error."""
    error = float(_fit(compared, ("delay",))[2][0])
    return Drift("delay", "delay", "", at_s, 0.0, error, None)


@dataclass(frozen=True, slots=True, eq=False)
class _Compared:
    """Everything over the noise: (equations,) and per number of each axis the same."""

    difference: ComplexArray
    columns: dict[tuple[str, int], ComplexArray]
    friction_n: FloatArray
    """(axes,): at first."""


def _compare(probes: Sequence[TimedProbe], shapes: ComplexArray, levels: FloatArray, delay_s: float) -> _Compared:
    lines, axes = np.nonzero(probes[0].lines.driven)
    w = 2 * np.pi * probes[0].lines.frequency_hz[lines]
    answer = np.array([probe.lines.acceleration_mps2[lines] for probe in probes])
    force = np.array([probe.lines.force_n[lines, axes] for probe in probes])
    own = np.take_along_axis(answer, axes[None, :, None], axis=2)[..., 0]
    count = BASE_CYCLES * len(set(levels.tolist()))
    force[count:] *= np.exp(-1j * w * delay_s)
    friction_n, shape = _first_friction(force / own, shapes[:, :, lines], (own, axes), count)
    base = {level: np.flatnonzero(levels[:count] == level) for level in set(levels.tolist())}

    def first(values: ComplexArray, wanted: FloatArray) -> ComplexArray:
        """Mean over the first probes of each wanted level; linear in answers to the same force."""
        return np.array([values[base[level]].mean(axis=0) for level in wanted])

    now = slice(count, None)
    answer0, own0, force0, shape0 = (first(each, levels[now]) for each in (answer, own, force, shape))
    both = own0 * own[now]
    apart = own[:count] - first(own, levels[:count])
    noise = float(np.sqrt(np.mean(np.abs(apart) ** 2) * BASE_CYCLES / (BASE_CYCLES - 1) * (1 + 1 / BASE_CYCLES)))
    over = np.abs(force0) / np.abs(both) * noise
    known = ((answer0 * shape[now] - answer[now] * shape0) * friction_n).sum(axis=2)
    difference = (force[now] * own0 - force0 * own[now] - known) / both
    columns = _columns(w, force[now] / own[now], axes, (answer0 * answer[now], answer0 * shape[now], both))
    return _Compared((difference / over).ravel(), {name: (c / over).ravel() for name, c in columns.items()}, friction_n)


def _columns(
    w: FloatArray, stiff: ComplexArray, axes: IntArray, products: tuple[ComplexArray, ComplexArray, ComplexArray]
) -> dict[tuple[str, int], ComplexArray]:
    """Change of the difference per unit of each parameter, (probes, lines). The delay is the same for all axes, as axis
    0."""
    motion, friction, both = products
    found: dict[tuple[str, int], ComplexArray] = {("delay", 0): 1j * w * stiff}
    for axis in range(3):
        moved = motion[..., axis] / both
        found["friction", axis] = friction[..., axis] / both
        found["mass", axis] = moved
        found["damping", axis] = moved / (1j * w)
        found["stiffness", axis] = -moved / w**2
        found["gain", axis] = np.where(axes == axis, -stiff, 0)
    return found


def _first_friction(
    stiff: ComplexArray, shapes: ComplexArray, own: tuple[ComplexArray, IntArray], count: int
) -> tuple[FloatArray, ComplexArray]:
    """Friction (N) along each axis at first, and its shapes, (probes, lines, axes), with the break-away that fits best:
    what depends on the level beside what is common to all levels, line by line."""
    answer, axes = own
    stiff = stiff[:count]
    best = (np.inf, np.zeros(3), shapes[0])
    for shape in shapes:
        here = np.take_along_axis(shape, axes[None, :, None], axis=2)[..., 0][:count] / answer[:count]
        misfit, levels_n = 0.0, np.zeros(3)
        for axis in range(3):
            of_axis = axes == axis
            weight = 1 / np.abs(stiff[:, of_axis])
            x = _real((here - here.mean(axis=0))[:, of_axis] * weight)
            y = _real((stiff - stiff.mean(axis=0))[:, of_axis] * weight)
            levels_n[axis] = max(0.0, float(x @ y / max(float(x @ x), 1e-300)))
            misfit += float(np.sum((y - levels_n[axis] * x) ** 2))
        if misfit < best[0]:
            best = (misfit, levels_n, shape)
    return best[1], best[2]


def _explain(compared: _Compared, at_s: float, causes: tuple[str, ...]) -> Iterator[Drift]:
    """The numbers of the best set of causes, as far as they matter."""
    count = 2 * len(compared.difference)
    # Misfit beyond the noise, of all causes together, is no cause: it widens every error.
    widened = max(1.0, _fit(compared, causes)[0] / max(1, count - len(_names(causes))))
    misfit = {some: _fit(compared, some)[0] for size in range(MOST + 1) for some in combinations(causes, size)}

    def cost(some: tuple[str, ...]) -> float:
        # Against noise while that is what is left, and as a ratio where the mechanism is more than its model.
        noisy = misfit[some] / widened
        return COST * len(_names(some)) + (count * float(np.log(noisy / count)) if noisy > count else noisy - count)

    best = min(misfit, key=cost)
    _, values, errors = _fit(compared, best)
    for (number, axis), value, error in zip(_names(best), values, errors, strict=True):
        wide = float(error * np.sqrt(widened))
        if abs(value) > max(LEAST[number], DEVIATIONS * wide):
            cause = next(cause for cause, numbers in CAUSES.items() if number in numbers)
            before = float(compared.friction_n[axis]) if number == "friction" else None
            where = "" if cause == "delay" else AXES[axis]
            yield Drift(cause, number, where, at_s, float(value), wide, before, _rivals(cause, best, misfit))


def _rivals(cause: str, best: tuple[str, ...], misfit: dict[tuple[str, ...], float]) -> tuple[str, ...]:
    """Causes that explain nearly as much in the place of this one."""
    others = {o: tuple(c for c in CAUSES if (c in best and c != cause) or c == o) for o in CAUSES if o not in best}
    return tuple(o for o, some in others.items() if misfit.get(some, np.inf) < SAME * misfit[best])


def _fit(compared: _Compared, causes: tuple[str, ...]) -> tuple[float, FloatArray, FloatArray]:
    """Squared misfit over noise, the numbers, and their standard errors."""
    y = _real(compared.difference) * np.sqrt(2)  # each part has half of the noise's power
    names = _names(causes)
    if not names:
        return float(y @ y), np.empty(0), np.empty(0)
    x = np.stack([_real(compared.columns[name]) for name in names], axis=1) * np.sqrt(2)
    size = np.linalg.norm(x, axis=0)
    inverse = np.linalg.pinv((x / size).T @ (x / size)) / np.outer(size, size)
    values = inverse @ x.T @ y
    return float(np.sum((y - x @ values) ** 2)), values, np.sqrt(np.diag(inverse))


def _names(causes: tuple[str, ...]) -> tuple[tuple[str, int], ...]:
    """Numbers and axes of these causes; a delay is that of all axes."""
    numbers = [number for cause in causes for number in CAUSES[cause]]
    return tuple((number, axis) for number in numbers for axis in range(1 if number == "delay" else 3))


def _real(values: ComplexArray) -> FloatArray:
    flat = values.ravel()
    return np.concatenate([flat.real, flat.imag])
