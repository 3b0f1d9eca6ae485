"""Concealed effects of sensor, clock and logger, between the motion of the handle and its record.

In a single channel: gain; nonlinearity a + cubic a^3 of the acceleration a; clipping at +-limit; offset; cross-axis
sensitivity. In all channels: lag (bandwidth in Hz, in place of 500 Hz); misalignment (rotation about a random axis);
drift, linear from 0 to `total` at the end; mains hum; quantization to `step`; clock error (ppm); lost samples (fraction
that repeats the sample before); logger offset (s; positive: the acceleration is delayed, but not the position).

Accelerations are in m/s^2. Drift and hum have a random share in each channel; the largest of those read is 1. The
strength interpolates the range of the main parameter geometrically. `challenge.sensor` applies the effects. All ranges
were chosen by hand; `axis` is not used where an effect acts on all channels.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.concealed_effect import ConcealedEffect, EffectContext, Values, replace_sensor
from study.evaluation.challenge.device import Device


def _replace_channel(device: Device, parameter: str, axis: int, value: float) -> Device:
    """Replace the value of a channel in a parameter (3,) of the sensor; returns a new device."""
    table = getattr(device.sensor, parameter).copy()
    table[axis] = value
    return replace_sensor(device, {parameter: table})


def _draw_misalignment(context: EffectContext) -> dict[str, float]:
    """Draw an angle of 0.1 to 15 degrees, and the rotation vector (degrees)."""
    angle_deg = context.interpolate_log(0.1, 15.0)
    rotation_deg = angle_deg * context.draw_direction()
    return {"degrees": angle_deg} | dict(zip(("about_x", "about_y", "about_z"), map(float, rotation_deg), strict=True))


def _build_misalignment(device: Device, axis: int, values: Values) -> Device:
    """Replace the orientation of the sensor by the rotation, also the cross-axis sensitivity of a nuisance effect."""
    rotation_deg = np.array([values["about_x"], values["about_y"], values["about_z"]])
    orientation = Rotation.from_rotvec(rotation_deg, degrees=True).as_matrix()
    return replace_sensor(device, {"orientation": orientation})


def _draw_shares(context: EffectContext) -> dict[str, float]:
    """Draw shares of the three channels, of either sign; the largest in magnitude among those that are read is 1."""
    shares = context.draw_direction()
    read_shares = shares[list(context.axes)]
    shares /= read_shares[np.argmax(np.abs(read_shares))]
    return dict(zip(("share_x", "share_y", "share_z"), map(float, shares), strict=True))


def _stack_shares(values: Values) -> FloatArray:
    """Stack the shares of the channels, (3,)."""
    return np.array([values["share_x"], values["share_y"], values["share_z"]])


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
    hum_mps2 = np.array([np.cos(values["phase"]) * amplitudes, np.sin(values["phase"]) * amplitudes])
    return replace_sensor(device, {"hum_mps2": hum_mps2, "hum_hz": values["frequency"]})


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
    return replace_sensor(device, {"orientation": mixing})


EFFECTS = (
    ConcealedEffect(
        "sensor_lag", "sensor", False,
        lambda context: {"bandwidth": context.interpolate_log(420.0, 30.0)},
        lambda device, axis, values: replace_sensor(device, {"bandwidth_hz": values["bandwidth"]}),
    ),
    ConcealedEffect(
        "sensor_clipping", "sensor", True,
        lambda context: {"limit": context.peak_mps2[context.axis] * (1.0 - context.interpolate_log(0.02, 0.7))},
        lambda device, axis, values: _replace_channel(device, "range_mps2", axis, values["limit"]),
    ),
    ConcealedEffect("sensor_misalignment", "sensor", False, _draw_misalignment, _build_misalignment),
    ConcealedEffect(
        "sensor_gain", "sensor", True,
        lambda context: {"gain": 1.0 + context.draw_sign() * context.interpolate_log(0.005, 0.3)},
        lambda device, axis, values: _replace_channel(device, "gain", axis, values["gain"]),
    ),
    ConcealedEffect(
        "sensor_nonlinearity", "sensor", True,
        lambda context: {
            "cubic": context.draw_sign() * context.interpolate_log(0.005, 0.25) / context.peak_mps2[context.axis] ** 2
        },
        lambda device, axis, values: _replace_channel(device, "cubic_gain", axis, values["cubic"]),
    ),
    ConcealedEffect(
        "sensor_drift", "sensor", False,
        lambda context: {"total": context.draw_sign() * context.interpolate_log(0.01, 2.0)} | _draw_shares(context),
        lambda device, axis, values: replace_sensor(device, {"drift_mps2": values["total"] * _stack_shares(values)}),
    ),
    ConcealedEffect(
        "quantization", "sensor", False,
        lambda context: {"step": context.interpolate_log(0.02, 1.5)},
        lambda device, axis, values: replace_sensor(device, {"resolution_mps2": values["step"]}),
    ),
    ConcealedEffect("mains_hum", "sensor", False, _draw_hum, _build_hum),
    ConcealedEffect(
        "clock_drift", "sensor", False,
        lambda context: {"ppm": context.draw_sign() * context.interpolate_log(0.5, 100.0)},
        lambda device, axis, values: replace_sensor(device, {"clock_error_ppm": values["ppm"]}),
    ),
    ConcealedEffect(
        "lost_samples", "sensor", False,
        lambda context: {"fraction": context.interpolate_log(1e-4, 0.04)},
        lambda device, axis, values: replace_sensor(device, {"lost_fraction": values["fraction"]}),
    ),
    ConcealedEffect("cross_axis_sensitivity", "sensor", True, _draw_cross_axis, _build_cross_axis),
    ConcealedEffect(
        "sensor_offset", "sensor", True,
        lambda context: {"offset": context.draw_sign() * context.interpolate_log(5e-4, 0.5)},
        lambda device, axis, values: _replace_channel(device, "offset_mps2", axis, values["offset"]),
    ),
    ConcealedEffect(
        "logger_offset", "sensor", False,
        lambda context: {"offset": context.draw_sign() * context.interpolate_log(1e-5, 5e-3)},
        lambda device, axis, values: replace_sensor(device, {"delay_s": values["offset"]}),
    ),
)  # fmt: skip
