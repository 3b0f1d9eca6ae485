"""Last reading of a rig, and its form for the rest of the program."""

import math
from dataclasses import dataclass

from equalizer.signals.signal import FloatArray
from study.devices.device import Look
from study.devices.rig import ACCELERATION, POSITION, SENSOR_CLIPPED


@dataclass(frozen=True, slots=True, eq=False)
class LastReading:
    """One reading. Replaced as a whole and never changed, so that any thread may read it."""

    reading: FloatArray
    """Shape (READING_SIZE,), as `study.devices.rig` lays it out."""
    buttons: frozenset[int]


def look_of(last: LastReading | None, missed_ticks: int) -> Look:
    """The look that screens may show; without a reading where nothing was read."""
    if last is None:
        return Look(None, None, sensor_clipped=False, buttons=frozenset(), missed_ticks=missed_ticks)
    return Look(
        position_m=_numbers(last.reading[POSITION]),
        acceleration_mps2=_numbers(last.reading[ACCELERATION]),
        sensor_clipped=bool(last.reading[SENSOR_CLIPPED] == 1.0),
        buttons=last.buttons,
        missed_ticks=missed_ticks,
    )


def _numbers(components: FloatArray) -> tuple[float, float, float] | None:
    x, y, z = (float(component) for component in components)
    return (x, y, z) if math.isfinite(x + y + z) else None
