"""Last reading of a rig, and its conversion to the `Look` of the device port, which displays use."""

import math
from dataclasses import dataclass

from equalizer.signals.signal import FloatArray
from study.devices.device import Look
from study.devices.rig import ACCELERATION, POSITION, SENSOR_CLIPPED


@dataclass(frozen=True, slots=True, eq=False)
class LastReading:
    """A reading with the buttons pressed at that time. It is replaced as a whole and never changed, so that any thread
    may read it without a lock."""

    reading: FloatArray
    """Shape (READING_SIZE,), as `study.devices.rig` lays it out."""
    buttons: frozenset[int]


def make_look(last: LastReading | None, missed_ticks: int) -> Look:
    """Convert a reading to a `Look`: position in m, acceleration in m/s². Both are None without a reading, or where
    their numbers are not finite. missed_ticks: of the present stimulus."""
    if last is None:
        return Look(None, None, sensor_clipped=False, buttons=frozenset(), missed_ticks=missed_ticks)
    return Look(
        position_m=_finite_triple(last.reading[POSITION]),
        acceleration_mps2=_finite_triple(last.reading[ACCELERATION]),
        sensor_clipped=bool(last.reading[SENSOR_CLIPPED] == 1.0),
        buttons=last.buttons,
        missed_ticks=missed_ticks,
    )


def _finite_triple(components: FloatArray) -> tuple[float, float, float] | None:
    """Three components as a tuple; None unless all are finite."""
    x, y, z = (float(component) for component in components)
    return (x, y, z) if math.isfinite(x + y + z) else None
