"""Converts the rows that the control loop recorded to a `Recording` with the counters of the safety layer.

The accelerations of an accelerometer with its own clock are inserted here, resampled to the ticks of the rows.
"""

from dataclasses import replace

import numpy as np

from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, Signal
from study.devices.device import DeviceInfo, Fault, Health, Played
from study.devices.governor.cells import ROW_SIZE
from study.devices.governor.governor import Governor
from study.devices.rig import OwnClockSensor

COMMAND, EXCITATION, POSITION, ACCELERATION, TRUTH = (slice(start, start + 3) for start in range(0, ROW_SIZE, 3))
"""Columns of a row, three components each: command and excitation (N), position (m), acceleration and true acceleration
(m/s²). The command is the written force; the excitation is the stimulus alone, without spring and damper."""


def record_held_stimulus(governor: Governor, info: DeviceInfo, apart: OwnClockSensor | None = None) -> Played:
    """Recording of a held stimulus: the end of its steady part, in whole loops unless a loop is longer than the ring.
    None where not even that much was recorded. apart: an accelerometer with its own clock, if any."""
    rows, loop = governor.rows(), governor.steady
    whole = len(loop) if len(loop) <= len(governor.buffer) else len(governor.buffer)
    kept = len(rows) // whole * whole
    rows, health = _with_acceleration(rows[len(rows) - kept :], governor, info, apart)
    if not kept:
        return Played(recording=None, health=health)
    amplitude_n = float(np.linalg.norm(loop, axis=1).max())
    segment = Segment(start=0, stop=kept, kind="sine", amplitude=amplitude_n, period=len(loop))
    return _make_played(rows, health, info, (segment,))


def record_commands(governor: Governor, info: DeviceInfo, apart: OwnClockSensor | None = None) -> Played:
    """Recording of commands that were played once; None after a fault or where they ended early. It has no segments:
    the caller knows them."""
    rows = governor.rows()
    if governor.fault is not Fault.NONE or len(rows) < len(governor.loop):
        return Played(recording=None, health=_with_acceleration(rows[:0], governor, info, apart)[1])
    return _make_played(*_with_acceleration(rows, governor, info, apart), info, ())


def _with_acceleration(
    rows: FloatArray, governor: Governor, info: DeviceInfo, apart: OwnClockSensor | None
) -> tuple[FloatArray, Health]:
    """Insert the acceleration at the tick of each row, missed ticks included, and its counters. rows: the newest rows
    of the governor."""
    due_s = governor.row_due_s()
    due_s = due_s[len(due_s) - len(rows) :]
    sensed = apart.sensed(governor.began_s, due_s, info.sample_rate_hz) if apart is not None else None
    if sensed is None:
        return rows, governor.health()
    rows = rows.copy()
    rows[:, ACCELERATION] = sensed.acceleration_mps2
    return rows, replace(governor.health(), sensor=sensed.health)


def _make_played(rows: FloatArray, health: Health, info: DeviceInfo, segments: tuple[Segment, ...]) -> Played:
    """Recording of rows (n, ROW_SIZE); the true acceleration only of a simulated device."""
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
        health=health,
        truth=Signal(truth, rate_hz, *acceleration) if info.simulated else None,
    )
