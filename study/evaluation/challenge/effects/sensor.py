"""Concealed effects of sensor, clock and logger, between the motion of the handle and its record.

In a single channel: gain; nonlinearity a + cubic a^3 of the acceleration a; clipping at +-limit; offset; cross-axis
sensitivity. In all channels: lag (bandwidth in Hz, in place of 500 Hz); misalignment (rotation about a random axis);
drift, linear from 0 to `total` at the end; mains hum; quantization to `step`; clock error (ppm); lost samples (fraction
that repeats the sample before); logger offset (s; positive: the acceleration is delayed, but not the position).

Accelerations are in m/s^2. Drift and hum have a random share in each channel; the largest of those read is 1. The
strength interpolates the range of the main parameter geometrically. `challenge.sensor` applies the effects. A
`_draw_...` function draws parameters, a `_build_...` function builds them into a device; all ranges were chosen by
hand. `axis` is not used where an effect acts on all channels.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.concealed_effect import ConcealedEffect, EffectContext, Values
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.sensor import Sensor


def _replace_sensor(device: Device, sensor: Sensor) -> Device:
    """Replace the sensor; returns a new device."""
    return replace(device, sensor=sensor)


def _set_channel(table: FloatArray, axis: int, value: float) -> FloatArray:
    """Replace the value of a channel in a copy of the table (3,)."""
    new_table = table.copy()
    new_table[axis] = value
    return new_table


def _draw_lag(context: EffectContext) -> dict[str, float]:
    """Draw the bandwidth, 420 Hz (weakest) to 30 Hz."""
    return {"bandwidth": context.interpolate_log(420.0, 30.0)}


def _build_lag(device: Device, axis: int, values: Values) -> Device:
    """Replace the bandwidth of all channels."""
    return _replace_sensor(device, replace(device.sensor, bandwidth_hz=values["bandwidth"]))


def _draw_clipping(context: EffectContext) -> dict[str, float]:
    """Draw the limit (m/s^2) that cuts 2 % to 70 % off the largest reading."""
    return {"limit": context.peak_mps2[context.axis] * (1.0 - context.interpolate_log(0.02, 0.7))}


def _build_clipping(device: Device, axis: int, values: Values) -> Device:
    """Clip one channel at +-limit."""
    return _replace_sensor(
        device, replace(device.sensor, range_mps2=_set_channel(device.sensor.range_mps2, axis, values["limit"]))
    )


def _draw_misalignment(context: EffectContext) -> dict[str, float]:
    """Draw an angle of 0.1 to 15 degrees, and the rotation vector (degrees)."""
    angle_deg = context.interpolate_log(0.1, 15.0)
    rotation_deg = angle_deg * context.draw_direction()
    return {"degrees": angle_deg} | dict(zip(("about_x", "about_y", "about_z"), map(float, rotation_deg), strict=True))


def _build_misalignment(device: Device, axis: int, values: Values) -> Device:
    """Replace the orientation of the sensor by the rotation, also the cross-axis sensitivity of a nuisance effect."""
    rotation_deg = np.array([values["about_x"], values["about_y"], values["about_z"]])
    return _replace_sensor(
        device, replace(device.sensor, orientation=Rotation.from_rotvec(rotation_deg, degrees=True).as_matrix())
    )


def _draw_gain(context: EffectContext) -> dict[str, float]:
    """Draw a gain that differs from 1 by 0.5 % to 30 %, in either direction."""
    return {"gain": 1.0 + context.draw_sign() * context.interpolate_log(0.005, 0.3)}


def _build_gain(device: Device, axis: int, values: Values) -> Device:
    """Replace the gain of one channel."""
    return _replace_sensor(device, replace(device.sensor, gain=_set_channel(device.sensor.gain, axis, values["gain"])))


def _draw_nonlinearity(context: EffectContext) -> dict[str, float]:
    """Draw cubic, 1/(m/s^2)^2: at the largest reading, the cubic term is 0.5 % to 25 % of the reading."""
    return {"cubic": context.draw_sign() * context.interpolate_log(0.005, 0.25) / context.peak_mps2[context.axis] ** 2}


def _build_nonlinearity(device: Device, axis: int, values: Values) -> Device:
    """Set the cubic coefficient of one channel."""
    return _replace_sensor(
        device, replace(device.sensor, cubic_gain=_set_channel(device.sensor.cubic_gain, axis, values["cubic"]))
    )


def _draw_shares(context: EffectContext) -> dict[str, float]:
    """Draw shares of the three channels, of either sign; the largest in magnitude among those that are read is 1."""
    shares = context.draw_direction()
    read_shares = shares[list(context.axes)]
    shares /= read_shares[np.argmax(np.abs(read_shares))]
    return dict(zip(("share_x", "share_y", "share_z"), map(float, shares), strict=True))


def _stack_shares(values: Values) -> FloatArray:
    """Stack the shares of the channels, (3,)."""
    return np.array([values["share_x"], values["share_y"], values["share_z"]])


def _draw_drift(context: EffectContext) -> dict[str, float]:
    """Draw the drift over the whole recording, 0.01 to 2 m/s^2 of either sign, and shares of the channels."""
    return {"total": context.draw_sign() * context.interpolate_log(0.01, 2.0)} | _draw_shares(context)


def _build_drift(device: Device, axis: int, values: Values) -> Device:
    """Set the drift of all channels."""
    return _replace_sensor(device, replace(device.sensor, drift_mps2=values["total"] * _stack_shares(values)))


def _draw_quantization(context: EffectContext) -> dict[str, float]:
    """Draw the step, 0.02 to 1.5 m/s^2."""
    return {"step": context.interpolate_log(0.02, 1.5)}


def _build_quantization(device: Device, axis: int, values: Values) -> Device:
    """Set the quantization step of all channels."""
    return _replace_sensor(device, replace(device.sensor, resolution_mps2=values["step"]))


def _draw_hum(context: EffectContext) -> dict[str, float]:
    """Draw the amplitude, 0.01 to 1 m/s^2; frequency, 50 or 60 Hz up to 0.05 Hz off; phase (rad); shares of the
    channels."""
    mains_hz = float(context.random.choice((50.0, 60.0))) + context.random.uniform(-0.05, 0.05)
    phase_rad = context.random.uniform(0.0, 2 * np.pi)
    return {"amplitude": context.interpolate_log(0.01, 1.0), "frequency": mains_hz, "phase": phase_rad} | _draw_shares(
        context
    )


def _build_hum(device: Device, axis: int, values: Values) -> Device:
    """Set the hum amplitude * share * sin(2 pi frequency t + phase): amplitudes of sine and cosine, (2, 3), m/s^2."""
    amplitudes = values["amplitude"] * _stack_shares(values)
    return _replace_sensor(
        device,
        replace(
            device.sensor,
            hum_mps2=np.array([np.cos(values["phase"]) * amplitudes, np.sin(values["phase"]) * amplitudes]),
            hum_hz=values["frequency"],
        ),
    )


def _draw_clock_error(context: EffectContext) -> dict[str, float]:
    """Draw the clock error, 0.5 to 100 ppm of either sign."""
    return {"ppm": context.draw_sign() * context.interpolate_log(0.5, 100.0)}


def _build_clock_error(device: Device, axis: int, values: Values) -> Device:
    """Set the error of the sensor's clock."""
    return _replace_sensor(device, replace(device.sensor, clock_error_ppm=values["ppm"]))


def _draw_lost_samples(context: EffectContext) -> dict[str, float]:
    """Draw the fraction of lost samples, 0.01 % to 4 %."""
    return {"fraction": context.interpolate_log(1e-4, 0.04)}


def _build_lost_samples(device: Device, axis: int, values: Values) -> Device:
    """Set the fraction of lost samples."""
    return _replace_sensor(device, replace(device.sensor, lost_fraction=values["fraction"]))


def _draw_cross_axis(context: EffectContext) -> dict[str, float]:
    """Draw shares of the two other channels, in cyclic order; together 0.3 % to 15 % (root of the sum of squares)."""
    angle_rad = context.random.uniform(0.0, 2 * np.pi)
    share = context.interpolate_log(0.003, 0.15)
    return {"from_next": float(share * np.cos(angle_rad)), "from_after_next": float(share * np.sin(angle_rad))}


def _build_cross_axis(device: Device, axis: int, values: Values) -> Device:
    """Set the shares of the other channels in one channel."""
    # Replaces the mixing of a nuisance effect in this row, so that the label agrees with the device.
    mixing = device.sensor.orientation.copy()
    mixing[axis, (axis + 1) % 3] = values["from_next"]
    mixing[axis, (axis + 2) % 3] = values["from_after_next"]
    return _replace_sensor(device, replace(device.sensor, orientation=mixing))


def _draw_offset(context: EffectContext) -> dict[str, float]:
    """Draw the offset, 0.0005 to 0.5 m/s^2 of either sign."""
    return {"offset": context.draw_sign() * context.interpolate_log(5e-4, 0.5)}


def _build_offset(device: Device, axis: int, values: Values) -> Device:
    """Set the offset of one channel."""
    return _replace_sensor(
        device, replace(device.sensor, offset_mps2=_set_channel(device.sensor.offset_mps2, axis, values["offset"]))
    )


def _draw_logger_offset(context: EffectContext) -> dict[str, float]:
    """Draw the delay of the acceleration, 10 µs to 5 ms (in s); negative: it is early."""
    return {"offset": context.draw_sign() * context.interpolate_log(1e-5, 5e-3)}


def _build_logger_offset(device: Device, axis: int, values: Values) -> Device:
    """Set the delay of the acceleration."""
    return _replace_sensor(device, replace(device.sensor, delay_s=values["offset"]))


EFFECTS = (
    ConcealedEffect("sensor_lag", "sensor", False, _draw_lag, _build_lag),
    ConcealedEffect("sensor_clipping", "sensor", True, _draw_clipping, _build_clipping),
    ConcealedEffect("sensor_misalignment", "sensor", False, _draw_misalignment, _build_misalignment),
    ConcealedEffect("sensor_gain", "sensor", True, _draw_gain, _build_gain),
    ConcealedEffect("sensor_nonlinearity", "sensor", True, _draw_nonlinearity, _build_nonlinearity),
    ConcealedEffect("sensor_drift", "sensor", False, _draw_drift, _build_drift),
    ConcealedEffect("quantization", "sensor", False, _draw_quantization, _build_quantization),
    ConcealedEffect("mains_hum", "sensor", False, _draw_hum, _build_hum),
    ConcealedEffect("clock_drift", "sensor", False, _draw_clock_error, _build_clock_error),
    ConcealedEffect("lost_samples", "sensor", False, _draw_lost_samples, _build_lost_samples),
    ConcealedEffect("cross_axis_sensitivity", "sensor", True, _draw_cross_axis, _build_cross_axis),
    ConcealedEffect("sensor_offset", "sensor", True, _draw_offset, _build_offset),
    ConcealedEffect("logger_offset", "sensor", False, _draw_logger_offset, _build_logger_offset),
)
