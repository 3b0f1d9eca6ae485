"""Five numbers per channel, input and band, and what they suggest. A suggestion, no finding: fits decide."""

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.diagnosis.distortion import Kind
from analysis.diagnosis.frequency_cells import Band
from analysis.diagnosis.level_trends import LevelTrend


@dataclass(frozen=True, slots=True)
class LinearMismatch:
    """Largest over levels, of the response of one output to one input in one band."""

    output: str
    quantity: str
    input: str
    band_hz: Band
    share: float
    significant: bool


@dataclass(frozen=True, slots=True)
class Reading:
    output: str
    quantity: str
    input: str
    band_hz: Band
    linear_mismatch: float | None
    """Share of the signal; None where no model was compared."""
    odd_db_per_doubling: float | None
    even_db_per_doubling: float | None
    varying_db_per_doubling: float | None
    position_mismatch: float | None
    """Share of the signal in the position channels in the same band, largest; None without them."""
    words: str
    """What this suggests; empty where nothing is there."""


def readings(trends: Sequence[LevelTrend], mismatches: Sequence[LinearMismatch] = ()) -> tuple[Reading, ...]:
    """One per output, input and octave."""
    keys = dict.fromkeys((t.output, t.quantity, t.input, t.band_hz) for t in trends if not t.whole_band)
    keys |= dict.fromkeys((m.output, m.quantity, m.input, m.band_hz) for m in mismatches)
    return tuple(_reading(key, trends, mismatches) for key in keys)


def _reading(
    key: tuple[str, str, str, Band], trends: Sequence[LevelTrend], mismatches: Sequence[LinearMismatch]
) -> Reading:
    mine = {t.kind: t for t in trends if (t.output, t.quantity, t.input, t.band_hz) == key and not t.whole_band}
    own = next((m for m in mismatches if (m.output, m.quantity, m.input, m.band_hz) == key), None)
    beside = [m for m in mismatches if m.quantity in _POSITIONS and (m.input, m.band_hz) == key[2:]]
    position = max((m.share for m in beside), default=None)
    odd, even, varying = (mine[kind].db_per_doubling if kind in mine else None for kind in _KINDS)
    words = _words(mine, own, any(m.significant for m in beside) if beside else None)
    return Reading(*key, own.share if own else None, odd, even, varying, position, words)


def _words(mine: dict[Kind, LevelTrend], own: LinearMismatch | None, position_too: bool | None) -> str:
    courses = {kind: trend.course for kind, trend in mine.items() if trend.present}
    if courses.get("odd") == "stays" and courses.get("even") == "stays":
        return "odd and even distortion alike at all levels: something tied to position"
    found = [_COURSES[kind, course] for kind, course in courses.items() if (kind, course) in _COURSES]
    if found:
        return "; ".join(found)
    if courses:
        return "distortion, at too few levels to say how it grows"
    if own is not None and own.significant:
        if position_too is None:
            return "a linear mismatch: parameters, a mode, a lag or a sensor"
        where = "in position, too: parameters, a mode or a lag" if position_too else "not in position: a sensor"
        return f"a linear mismatch, {where}"
    return ""


_KINDS: tuple[Kind, Kind, Kind] = ("odd", "even", "varying")
_POSITIONS = ("position", "angle")
_COURSES = {
    ("odd", "falls"): "odd distortion falls with level: friction or a dead zone",
    ("odd", "rises"): "odd distortion rises with level: stiffness or drag",
    ("odd", "rises from nothing"): "odd distortion rises from nothing: a limit or clipping",
    ("odd", "stays"): "odd distortion keeps its share at all levels",
    ("even", "falls"): "even distortion falls with level: asymmetric friction or a bias",
    ("even", "rises"): "even distortion rises with level: an even stiffness, the pose or an asymmetry",
    ("even", "rises from nothing"): "even distortion rises from nothing: a one-sided limit or the pose",
    ("even", "stays"): "even distortion keeps its share at all levels",
    ("either", "falls"): "distortion falls with level: friction or a dead zone",
    ("either", "rises"): "distortion rises with level: stiffness, drag or the pose",
    ("either", "rises from nothing"): "distortion rises from nothing: a limit or clipping",
    ("varying", "falls"): "what varies between periods takes little notice of level: something from outside",
    ("varying", "stays"): "what varies between periods grows with the signal: timing, or a device that changes",
    ("varying", "rises"): "what varies between periods outgrows the signal: timing, rattling or a device that changes",
    ("varying", "rises from nothing"): "what varies between periods rises from nothing: rattling or lost samples",
}
