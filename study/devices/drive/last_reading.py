"""Last reading of a device's loop, and its conversion to a `Look`, the snapshot of a device that displays show."""

import math
from dataclasses import dataclass

from equalizer.signals.signal import FloatArray
from study.devices.device import Look
from study.devices.rig import ACCELERATION, POSITION, SENSOR_CLIPPED


@dataclass(frozen=True, slots=True, eq=False)
class LastReading:
    """A reading with the buttons pressed at that time. The object is replaced and never modified, so that any thread
    may read it without a lock."""

    reading: FloatArray
    """Shape (READING_SIZE,), as `study.devices.rig` lays it out."""
    buttons: frozenset[int]
    """Numbers of the pressed buttons."""


def make_look(last_reading: LastReading | None, missed_ticks: int) -> Look:
    """Convert a reading to a `Look`: position in m, acceleration in m/s². Each is None without a reading, or where its
    components are not all finite. missed_ticks: number of ticks missed since the present stimulus began."""
    if last_reading is None:
        return Look(None, None, sensor_clipped=False, buttons=frozenset(), missed_ticks=missed_ticks)
    return Look(
        position_m=_to_finite_triple(last_reading.reading[POSITION]),
        acceleration_mps2=_to_finite_triple(last_reading.reading[ACCELERATION]),
        sensor_clipped=bool(last_reading.reading[SENSOR_CLIPPED] == 1.0),
        buttons=last_reading.buttons,
        missed_ticks=missed_ticks,
    )


def _to_finite_triple(components: FloatArray) -> tuple[float, float, float] | None:
    """Convert three components to a tuple; None unless all are finite."""
    x, y, z = (float(component) for component in components)
    return (x, y, z) if math.isfinite(x + y + z) else None
