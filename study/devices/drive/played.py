"""From the rows of the compiled loop to what was played: a recording and its health."""

import numpy as np

from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, Signal
from study.devices.device import DeviceInfo, Fault, Played
from study.devices.governor.cells import ROW_SIZE
from study.devices.governor.governor import Governor

COMMAND, EXCITATION, POSITION, ACCELERATION, TRUTH = (slice(start, start + 3) for start in range(0, ROW_SIZE, 3))


def record_held_stimulus(governor: Governor, info: DeviceInfo) -> Played:
    """Of a held stimulus: the last of its steady part, whole loops unless the loop is longer than the ring."""
    rows, loop = governor.rows(), governor.steady
    whole = len(loop) if len(loop) <= len(governor.buffer) else len(governor.buffer)
    kept = len(rows) // whole * whole
    if not kept:
        return Played(recording=None, health=governor.health())
    amplitude_n = float(np.linalg.norm(loop, axis=1).max())
    segment = Segment(start=0, stop=kept, kind="sine", amplitude=amplitude_n, period=len(loop))
    return _make_played(rows[-kept:], governor, info, (segment,))


def record_commands(governor: Governor, info: DeviceInfo) -> Played:
    """Of commands played once through; which segments they are, the caller knows."""
    health = governor.health()
    if health.fault is not Fault.NONE or len(governor.rows()) < len(governor.loop):
        return Played(recording=None, health=health)
    return _make_played(governor.rows(), governor, info, ())


def _make_played(rows: FloatArray, governor: Governor, info: DeviceInfo, segments: tuple[Segment, ...]) -> Played:
    rate_hz = info.sample_rate_hz
    acceleration = ("acceleration", "m/s^2", ("ax", "ay", "az"))
    force = ("force", "N", ("fx", "fy", "fz"))
    truth = rows[:, TRUTH]
    return Played(
        recording=Recording(
            device=info.name,
            command=Signal(rows[:, COMMAND], rate_hz, *force),
            response=Signal(rows[:, ACCELERATION], rate_hz, *acceleration),
            position=Signal(rows[:, POSITION], rate_hz, "position", "m", ("x", "y", "z")),
            excitation=Signal(rows[:, EXCITATION], rate_hz, *force),
            segments=segments,
        ),
        health=governor.health(),
        truth=Signal(truth, rate_hz, *acceleration) if info.simulated else None,
    )
