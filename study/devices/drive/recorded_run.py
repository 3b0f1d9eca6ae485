"""Converts the rows that the control loop recorded to a `Recording` with the counters of the safety layer.

The accelerations of an accelerometer with its own clock are inserted here, resampled to the ticks of the rows.
"""

from dataclasses import replace

import numpy as np

from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, Signal
from study.devices.device import DeviceInfo, Fault, Health, PlaybackResult
from study.devices.governor.cells import ROW_SIZE
from study.devices.governor.governor import Governor
from study.devices.rig import AsynchronousAccelerometer

COMMAND, EXCITATION, POSITION, ACCELERATION, TRUTH = (slice(start, start + 3) for start in range(0, ROW_SIZE, 3))
"""Columns of a row, three components each: command and excitation (N), position (m), acceleration and true acceleration
(m/s²). The command is the written force; the excitation is the stimulus alone, without spring and damper."""


def make_stimulus_recording(
    governor: Governor, info: DeviceInfo, own_clock_sensor: AsynchronousAccelerometer | None = None
) -> PlaybackResult:
    """Make the recording of a held stimulus: the end of its steady part, in whole loops; of a loop longer than the
    row buffer, the whole buffer. The recording is None where fewer rows were recorded. own_clock_sensor: an
    accelerometer with its own clock, if any."""
    rows, loop = governor.copy_rows(), governor.steady
    loop_row_count = len(loop) if len(loop) <= len(governor.buffer) else len(governor.buffer)
    kept_row_count = len(rows) // loop_row_count * loop_row_count
    rows, health = _insert_acceleration(rows[len(rows) - kept_row_count :], governor, info, own_clock_sensor)
    if not kept_row_count:
        return PlaybackResult(recording=None, health=health)
    amplitude_n = float(np.linalg.norm(loop, axis=1).max())
    segment = Segment(start=0, stop=kept_row_count, kind="sine", amplitude=amplitude_n, period=len(loop))
    return _make_result(rows, health, info, (segment,))


def make_commands_recording(
    governor: Governor, info: DeviceInfo, own_clock_sensor: AsynchronousAccelerometer | None = None
) -> PlaybackResult:
    """Make the recording of commands that were played once; it is None after a fault, or where they ended early. It has
    no segments: the caller adds them. own_clock_sensor: an accelerometer with its own clock, if any."""
    rows = governor.copy_rows()
    if governor.fault is not Fault.NONE or len(rows) < len(governor.loop):
        return PlaybackResult(
            recording=None, health=_insert_acceleration(rows[:0], governor, info, own_clock_sensor)[1]
        )
    return _make_result(*_insert_acceleration(rows, governor, info, own_clock_sensor), info, ())


def _insert_acceleration(
    rows: FloatArray, governor: Governor, info: DeviceInfo, own_clock_sensor: AsynchronousAccelerometer | None
) -> tuple[FloatArray, Health]:
    """Insert the acceleration at the tick of each row, missed ticks included, and its counters; without
    `own_clock_sensor` the rows stay unchanged. rows: the newest rows of the governor."""
    due_times_s = governor.compute_row_times()
    due_times_s = due_times_s[len(due_times_s) - len(rows) :]
    sensor_data = (
        own_clock_sensor.sensed(governor.began_s, due_times_s, info.sample_rate_hz)
        if own_clock_sensor is not None
        else None
    )
    if sensor_data is None:
        return rows, governor.collect_health()
    rows = rows.copy()
    rows[:, ACCELERATION] = sensor_data.acceleration_mps2
    return rows, replace(governor.collect_health(), sensor=sensor_data.health)


def _make_result(rows: FloatArray, health: Health, info: DeviceInfo, segments: tuple[Segment, ...]) -> PlaybackResult:
    """Make the result from rows (n, ROW_SIZE); it contains the true acceleration only for a simulated device."""
    rate_hz = info.sample_rate_hz
    acceleration_axes = ("acceleration", "m/s^2", ("ax", "ay", "az"))
    force_axes = ("force", "N", ("fx", "fy", "fz"))
    true_acceleration = rows[:, TRUTH]
    return PlaybackResult(
        recording=Recording(
            device=info.name,
            command=Signal(rows[:, COMMAND], rate_hz, *force_axes),
            response=Signal(rows[:, ACCELERATION], rate_hz, *acceleration_axes),
            position=Signal(rows[:, POSITION], rate_hz, "position", "m", ("x", "y", "z")),
            excitation=Signal(rows[:, EXCITATION], rate_hz, *force_axes),
            segments=segments,
        ),
        health=health,
        truth=Signal(true_acceleration, rate_hz, *acceleration_axes) if info.simulated else None,
    )
