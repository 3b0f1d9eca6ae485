"""Terms that physics may add to the force balance of a moving axis, each over a grid of its nonlinear numbers.

A law's force is linear in its weights: sum of weight times column, with columns from the measured motion. The grids
span what a recording can tell (its speeds, its travel, its band), so that no starting value is needed.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, rfft, rfftfreq

from analysis.diagnosis.balance.motion import Motion
from equalizer.effects.bristle_kernel import bent
from equalizer.signals.signal import FloatArray

Numbers = tuple[float, ...]
"""Nonlinear numbers: speeds, pitches, time constants; in SI."""
Columns = Callable[[Motion, Numbers], FloatArray]
"""(n, weights)"""
Values = Callable[[FloatArray, Numbers, float], dict[str, float] | None]
"""Of weights (weights,), nonlinear numbers and the moving mass: the effect's parameters; None where no such physics has
these signs."""


@dataclass(frozen=True, slots=True, eq=False)
class Law:
    effect: str
    """A name of the vocabulary, or one written like them for physics that it lacks."""
    channel: int
    """Of the motion; -1 = none."""
    numbers: Numbers
    columns: Columns
    values: Values
    linear: bool = False
    """In the motion: a linear model of a higher order could take its place."""
    bounded: tuple[tuple[float, float], ...] = ()
    """Between which each nonlinear number stays."""

    @property
    def key(self) -> tuple[str, int]:
        return self.effect, self.channel


@dataclass(frozen=True, slots=True)
class Scales:
    """Of one channel's motion where it is fitted."""

    speed: float
    """rms"""
    travel: float
    """From end to end,"""
    low: float
    high: float
    seconds: float
    band_hz: float
    turns: bool
    """It goes round and round, so that no position is special but within a turn."""
    rotational: bool


def scales_of(motions: Sequence[Motion], channel: int, rotational: bool) -> Scales:
    position = np.concatenate([one.position[one.fit, channel] for one in motions])
    velocity = np.concatenate([one.velocity[one.fit, channel] for one in motions])
    low, high = float(position.min()), float(position.max())
    seconds = sum(int(one.fit.sum()) for one in motions) / motions[0].rate_hz
    speed = float(np.sqrt(np.mean(velocity**2)))
    turns = rotational and high - low > 4 * np.pi
    return Scales(speed, high - low, low, high, seconds, motions[0].band_hz, turns, rotational)


def laws_of(motions: Sequence[Motion], rotational: bool) -> Iterator[Law]:
    """All but those that hang on pitches, which a remainder shows; see `pitched`."""
    for channel in range(len(motions[0].channels)):
        scales = scales_of(motions, channel, rotational)
        yield from _friction(channel, scales)
        yield from _damping(channel, scales)
        if not scales.turns:
            yield from _stiffness(channel, scales)
        if np.isfinite(scales.band_hz):
            yield from _dynamics(channel, scales)
        yield from _conditions(motions, channel)
    if np.isfinite(motions[0].band_hz):
        yield Law("drifting_force", -1, (), lambda m, _: m_time(m), _named("rate_per_s"))


def m_time(motion: Motion) -> FloatArray:
    """(n, 1): from -1 to 1 over the part."""
    return np.linspace(-1.0, 1.0, len(motion.force))[:, None]


def sliding(velocity: FloatArray, width: float) -> FloatArray:
    """The sign of a velocity, turned round within `width` of standstill."""
    return np.asarray(np.tanh(velocity / width))


SHARP = 0.01
"""Of the rms speed: within which a dry friction's sign turns round, where nothing shows a wider one."""


def _friction(c: int, of: Scales) -> Iterator[Law]:
    sharp = SHARP * of.speed
    spans = ((0.1 * sharp, 0.5 * of.speed),)
    for width in sharp * np.geomspace(1.0, 50.0, 7):
        yield Law(
            "coulomb_friction", c, (float(width),), lambda m, n: sliding(m.velocity[:, c : c + 1], n[0]),
            _positive("level"), bounded=spans,
        )  # fmt: skip
    for slow in of.speed * np.geomspace(0.03, 1.5, 7):
        yield Law("stribeck_friction", c, (float(slow),), _stribeck(c, sharp), _stribeck_values, bounded=spans)
    if of.turns:
        widths = np.geomspace(0.003, 0.5, 7)
    else:
        widths = of.travel * np.geomspace(1e-3, 0.3, 9)
    for width in widths:
        yield Law(
            "presliding_hysteresis", c, (float(width),), lambda m, n: bent(m.position[:, c], n[0])[:, None],
            _presliding_values, bounded=((0.1 * widths[0], widths[-1]),),
        )  # fmt: skip
    yield Law("asymmetric_friction", c, (), _asymmetric(c, sharp), _asymmetric_values)
    if np.isfinite(of.band_hz):
        yield Law(
        "drifting_friction", c, (), lambda m, _: sliding(m.velocity[:, [c]], sharp) * m_time(m), _named("change"),
    )  # fmt: skip
    if not of.turns:
        yield Law("position_dependent_friction", c, (), _position_dependent(c, sharp), _position_dependent_values)


def _stribeck(c: int, sharp: float) -> Columns:
    def columns(m: Motion, n: Numbers) -> FloatArray:
        v = m.velocity[:, c : c + 1]
        return np.hstack([sliding(v, sharp), sliding(v, sharp) * np.exp(-((v / n[0]) ** 2))])

    return columns


def _stribeck_values(w: FloatArray, n: Numbers, mass: float) -> dict[str, float] | None:
    if w[0] <= 0 or w[1] <= 0:
        return None
    return {"coulomb": float(w[0]), "static": float(w[0] + w[1]), "speed": n[0]}


def _presliding_values(w: FloatArray, n: Numbers, mass: float) -> dict[str, float] | None:
    return {"level": float(w[0]), "stiffness": float(w[0] / n[0])} if w[0] > 0 else None


def _asymmetric(c: int, sharp: float) -> Columns:
    return lambda m, _: np.hstack(
        [np.maximum(sliding(m.velocity[:, [c]], sharp), 0.0), np.minimum(sliding(m.velocity[:, [c]], sharp), 0.0)]
    )


def _asymmetric_values(w: FloatArray, n: Numbers, mass: float) -> dict[str, float] | None:
    return {"level_positive": float(w[0]), "level_negative": float(w[1])} if w.min() > 0 else None


def _position_dependent(c: int, sharp: float) -> Columns:
    def columns(m: Motion, _: Numbers) -> FloatArray:
        rubbing, q = sliding(m.velocity[:, [c]], sharp), m.position[:, [c]]
        return np.hstack([rubbing, rubbing * q, rubbing * q**2])

    return columns


def _position_dependent_values(w: FloatArray, n: Numbers, mass: float) -> dict[str, float] | None:
    if w[0] <= 0:
        return None
    return {"level": float(w[0]), "slope_per_m": float(w[1] / w[0]), "bend_per_m2": float(w[2] / w[0])}


def _damping(c: int, of: Scales) -> Iterator[Law]:
    yield Law(
        "quadratic_damping", c, (), lambda m, _: m.velocity[:, [c]] * np.abs(m.velocity[:, [c]]),
        _positive("coefficient"),
    )  # fmt: skip
    yield Law("drifting_damping", c, (), lambda m, _: m.velocity[:, [c]] * m_time(m), _named("change"))
    if not np.isfinite(of.band_hz):
        return
    for tau in np.geomspace(0.5 / of.band_hz, of.seconds / 10, 7):
        yield Law(
            "viscoelastic_relaxation", c, (float(tau),),
            lambda m, n: _through(m.velocity[:, [c]], m.rate_hz, lambda s: n[0] / (1 + n[0] * s)),
            lambda w, n, mass: {"stiffness": float(w[0]), "time_constant": n[0]} if w[0] > 0 else None,
            linear=True, bounded=((0.1 / of.band_hz, of.seconds / 4),),
        )  # fmt: skip


def _stiffness(c: int, of: Scales) -> Iterator[Law]:
    yield Law("hardening_stiffness", c, (), lambda m, _: m.position[:, [c]] ** 3, _named("k3"))
    yield Law("asymmetric_stiffness", c, (), lambda m, _: m.position[:, [c]] ** 2, _named("k2"))
    for share in (0.02, 0.05, 0.1, 0.2):
        for end, side in ((of.high - share * of.travel, 1.0), (of.low + share * of.travel, -1.0)):
            yield Law(
                "end_stop", c, (float(end),),
                lambda m, n, side=side: side * np.maximum(side * (m.position[:, [c]] - n[0]), 0.0),
                lambda w, n, mass: {"position": n[0], "stiffness": float(w[0])} if w[0] > 0 else None,
            )  # fmt: skip
    for half in of.travel * np.geomspace(0.01, 0.3, 6):
        yield Law(
            "backlash", c, (float(half),), lambda m, n: -np.clip(m.position[:, [c]], -n[0], n[0]),
            lambda w, n, mass: {"gap": 2 * n[0], "contact_stiffness": float(w[0])} if w[0] > 0 else None,
            bounded=((1e-3 * of.travel, 0.45 * of.travel),),
        )  # fmt: skip
    if of.rotational and of.travel > 0.5:
        yield Law(
            "gravity_torque", c, (), lambda m, _: np.hstack([np.sin(m.position[:, [c]]), np.cos(m.position[:, [c]])]),
            lambda w, n, mass: {"torque": float(np.hypot(*w)), "angle": float(np.arctan2(w[1], w[0]))},
        )  # fmt: skip


def _dynamics(c: int, of: Scales) -> Iterator[Law]:
    if not of.turns:
        yield Law(
            "pose_dependent_inertia", c, (),
            lambda m, _: m.position[:, [c]] * m.acceleration[:, [c]] + 0.5 * m.velocity[:, [c]] ** 2,
            lambda w, n, mass: {"per_m": float(w[0] / mass)} if mass > 0 else None,
        )  # fmt: skip
    for ratio in (0.02, 0.1, 0.4):
        for f in of.band_hz * np.geomspace(0.02, 1.2, 12):
            yield Law(
                "extra_mode", c, (float(f), ratio), lambda m, n: _carried(m, c, n), _mode_values, linear=True,
                bounded=((0.005 * of.band_hz, 1.5 * of.band_hz), (0.002, 1.0)),
            )  # fmt: skip
    yield Law(
        "amplifier_lag", c, (), lambda m, _: _through(m.acceleration[:, [c]], m.rate_hz, lambda s: s),
        lambda w, n, mass: {"time_constant": float(w[0] / mass)} if mass > 0 and w[0] > 0 else None, linear=True,
    )  # fmt: skip


def _carried(m: Motion, c: int, n: Numbers) -> FloatArray:
    """The force per mass of a body on a spring that hangs on the axis."""
    turn, loss = 2 * np.pi * n[0], 2 * n[1] * 2 * np.pi * n[0]
    return _through(m.acceleration[:, [c]], m.rate_hz, lambda s: (turn**2 + loss * s) / (s**2 + loss * s + turn**2))


def _mode_values(w: FloatArray, n: Numbers, mass: float) -> dict[str, float] | None:
    return {"frequency": n[0], "mass": float(w[0]), "damping_ratio": n[1]} if w[0] > 0 else None


def _conditions(motions: Sequence[Motion], c: int) -> Iterator[Law]:
    for k in range(motions[0].condition.shape[1]):
        yield Law(
            "condition_dependent_damping", c, (float(k),),
            lambda m, n: m.condition[:, [int(n[0])]] * m.velocity[:, [c]], _named("change"),
        )  # fmt: skip
        yield Law(
            "condition_dependent_friction", c, (float(k),),
            lambda m, n: m.condition[:, [int(n[0])]] * np.sign(m.velocity[:, [c]]), _named("change"),
        )  # fmt: skip
        yield Law(
            "condition_dependent_stiffness", c, (float(k),),
            lambda m, n: m.condition[:, [int(n[0])]] * m.position[:, [c]], _named("change"),
        )  # fmt: skip


def pitched(channel: int, pitch: float, of: Scales) -> Law:
    """A force that repeats along the way."""
    longest = 2 * np.pi if of.turns else 0.5 * of.travel
    return Law(
        "cogging", channel, (pitch,),
        lambda m, n: np.hstack(
            [np.sin(2 * np.pi * m.position[:, [channel]] / n[0]), np.cos(2 * np.pi * m.position[:, [channel]] / n[0])]
        ),
        # The catalogue's force pushes along the motion where the balance's pulls.
        lambda w, n, mass: {
            "amplitude": float(np.hypot(*w)), "pitch": n[0], "phase": float(np.arctan2(-w[1], -w[0])),
        } if n[0] <= longest else None,
        bounded=((0.9 * pitch, min(1.1 * pitch, longest)),),
    )  # fmt: skip


def likely_pitches(
    motions: Sequence[Motion], remainders: Sequence[FloatArray], channel: int, of: Scales
) -> list[float]:
    """Of what is left of the force (kept samples each), the strongest lines over the position, the strongest first."""
    q = np.concatenate([one.position[:: one.step, channel][one.kept(one.fit)] for one in motions])
    left = np.concatenate([r[one.kept(one.fit)] for one, r in zip(motions, remainders, strict=True)])
    longest = 2 * np.pi if of.turns else 0.5 * of.travel
    # Shorter ones pass faster than the band's end at the usual speed.
    shortest = max(of.speed / of.band_hz, longest / 400)
    if shortest >= longest or not len(left):
        return []
    finest = 1 / of.travel if not of.turns else 1 / (2 * np.pi)
    lines = np.arange(1 / longest, 1 / shortest, finest * (1.0 if of.turns else 0.35))[:600]
    every = max(len(q) // 6000, 1)
    power = np.array([abs(np.mean(left[::every] * np.exp(-2j * np.pi * line * q[::every]))) for line in lines])
    peaks = [k for k in range(len(power)) if power[k] == power[max(k - 2, 0) : k + 3].max()]
    return [float(1 / lines[k]) for k in sorted(peaks, key=lambda k: -power[k])[:4]]


def _named(*names: str) -> Values:
    return lambda w, n, mass: dict(zip(names, map(float, w), strict=True))


def _positive(name: str) -> Values:
    return lambda w, n, mass: {name: float(w[0])} if w[0] > 0 else None


def _through(samples: FloatArray, rate_hz: float, gain: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """A causal linear filter from rest, by lines; padded by as much again, so that its memory does not wrap round."""
    count = len(samples)
    spectrum = rfft(samples, 2 * count, axis=0)
    s = 2j * np.pi * rfftfreq(2 * count, 1 / rate_hz)
    return np.asarray(irfft(gain(s)[:, None] * spectrum, 2 * count, axis=0)[:count])
