"""Acceleration ellipsoids: how much of the handle's motion follows the direction of the commanded force (figure 3 of
Wilson, Chan, Salisbury and Niemeyer, Multi-DOF Equalization of Haptic Devices).

Two definitions, both for a sinusoidal force of constant amplitude along a test direction:

* second moments, as published: S = mean of a a' (3 x 3) over whole periods, with a the acceleration without its mean;
  the semi-axes are the square roots of its eigenvalues. Noise, hum and harmonics all count as motion, so a noisy sensor
  makes the ellipsoid rounder.
* phasors: the ellipse that Re(p exp(i phi)) traces, with p (3,) the acceleration's phasor at the driven frequency, by
  lock-in. Noise averages out, harmonics are excluded, and a phase difference between axes widens the ellipse.

Frame: first axis = test direction; third = the device axis most nearly perpendicular to it, made perpendicular;
second = third x first. For a direction in a plane of device axes the first two axes span that plane.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from equalizer.signals.lockin import estimate_phasors
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray

MOST_HARMONICS = 5
"""Largest number of harmonics that are fitted, the fundamental included; of the others only those below half the sample
rate are."""
ORTHONORMALITY_TOLERANCE = 1e-3
"""Largest error of an entry of R R' against the identity, R a rotation: allows entries written with three digits.
Chosen."""


@dataclass(frozen=True, slots=True)
class MomentEllipsoid:
    """Ellipsoid by second moments of the acceleration: the published definition."""

    mean_square: tuple[tuple[float, ...], ...]
    """(3, 3) in (m/s^2)^2, in the frame of the test direction; its diagonal is the mean squared acceleration."""
    semi_axes_mps2: tuple[float, float, float]
    """Root mean square acceleration along the principal axes, largest first."""
    tilt_deg: float
    """Angle of the largest principal axis from the test direction, 0 to 90 degrees."""
    turn_deg: float
    """Signed angle of the largest principal axis, projected on the first two axes of the frame, -90 to 90 degrees: for
    drawing."""

    @property
    def normalised_axes(self) -> tuple[float, float]:
        """The two largest semi-axes, divided by the largest: 1, and a ratio from 0 to 1."""
        return 1.0, self.semi_axes_mps2[1] / self.semi_axes_mps2[0]


@dataclass(frozen=True, slots=True)
class PhasorEllipse:
    """Ellipse of the acceleration at the driven frequency alone. Angles are those of its larger axis, as in
    `MomentEllipsoid`."""

    semi_axes_mps2: tuple[float, float]
    """Amplitudes along the two axes of the ellipse, larger first."""
    tilt_deg: float
    turn_deg: float
    ellipticity: float
    """Smaller over larger axis: 0 for a straight line, 1 for a circle."""
    on_axis_mps2: float
    """Amplitude along the test direction."""
    off_axis_ratio: float | None
    """Amplitude perpendicular to the test direction over that along it; None if the latter is 0. The perpendicular
    amplitude is the root sum of squares of both axes."""
    harmonic_share: float
    """Squared amplitudes of harmonics 2 to `MOST_HARMONICS` below half the sample rate, summed over all axes, over
    those of the fundamental."""


@dataclass(frozen=True, slots=True)
class EllipsoidResult:
    """Acceleration ellipsoid by both definitions, at a frequency and along a test direction."""

    frequency_hz: float
    along: str
    """Name of the test direction."""
    amplitude_n: float
    moments: MomentEllipsoid
    phasor: PhasorEllipse


def compute_ellipsoids(recording: Recording, sensor_to_device: FloatArray | None = None) -> tuple[EllipsoidResult, ...]:
    """Compute the ellipsoids of each sinusoid of the recording, in the order played.

    The response must be acceleration in m/s^2 on three axes; meta["segments"] states frequency_hz, along and
    unit_vector (in the device's frame) of each sinusoidal segment. sensor_to_device: (3, 3) rotation from the sensor's
    frame to the device's, identity by default. Raises ValueError where the recording lacks any of these, has no
    sinusoid, or has missing, constant or too few samples in one.
    """
    response = recording.response
    if response.samples.shape[1] != 3 or response.quantity != "acceleration":
        raise ValueError(
            f"an acceleration ellipsoid needs a response of 3 accelerations, not {response.samples.shape[1]} "
            f"channels of {response.quantity}"
        )
    descriptions = _read_segment_descriptions(recording)
    rotation = np.eye(3) if sensor_to_device is None else np.asarray(sensor_to_device, dtype=np.float64)
    ellipsoids = []
    for segment_number, (segment, description) in enumerate(
        zip(recording.segments, descriptions, strict=True), start=1
    ):
        if segment.kind != "sine":
            continue
        acceleration_mps2 = response.samples[segment.start : segment.stop] @ rotation.T
        if not np.isfinite(acceleration_mps2).all():
            raise ValueError(f"segment {segment_number} (sine): the response has missing values")
        ellipsoids.append(_compute_segment_ellipsoid(acceleration_mps2, recording.sample_rate_hz, segment, description))
    if not ellipsoids:
        raise ValueError(
            "the recording has no segment of kind sine, so there is no ellipsoid to compute; "
            "record sinusoids along several directions"
        )
    return tuple(ellipsoids)


def read_sensor_frame(recording: Recording) -> FloatArray | None:
    """Read the rotation (3, 3) from the sensor's axes to the device's from the recording's metadata (sensor,
    frame_to_device); None if it states none.

    Raises ValueError where it is not a (3, 3) matrix of numbers, where its rows are not orthonormal, which would
    distort every ellipse, and for a reflection, which would mirror it.
    """
    sensor = recording.meta.get("sensor")
    stated_rotation = sensor.get("frame_to_device") if isinstance(sensor, dict) else None
    if stated_rotation is None:
        return None
    try:
        rotation = np.asarray(stated_rotation, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError("the sensor's frame is not a matrix of numbers") from error
    if rotation.shape != (3, 3):
        raise ValueError(f"the sensor's frame has the shape {rotation.shape}; it must be (3, 3)")
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=ORTHONORMALITY_TOLERANCE):
        raise ValueError("the sensor's frame is not a rotation: its rows must be perpendicular and of length 1")
    if np.linalg.det(rotation) < 0.0:
        raise ValueError("the sensor's frame is a reflection, not a rotation: an axis of it has the wrong sign")
    return rotation


def compute_direction_frame(unit_vector: FloatArray) -> FloatArray:
    """Compute the matrix (3, 3) whose rows are the axes of the test direction's frame, so that frame @ v has the
    components of a vector v of the device's frame. Raises ValueError unless unit_vector is (3,) and of norm 1 (within
    0.1 %)."""
    first_axis = np.asarray(unit_vector, dtype=np.float64)
    norm = float(np.linalg.norm(first_axis))
    if first_axis.shape != (3,) or not math.isclose(norm, 1.0, rel_tol=1e-3):
        raise ValueError(f"unit_vector must be three numbers of norm 1, not {first_axis.tolist()}")
    first_axis = first_axis / norm
    third_axis = np.eye(3)[int(np.argmin(np.abs(first_axis)))]
    third_axis = third_axis - (third_axis @ first_axis) * first_axis
    third_axis = third_axis / np.linalg.norm(third_axis)
    return np.stack([first_axis, np.cross(third_axis, first_axis), third_axis])


def compute_moment_ellipsoid(samples: FloatArray) -> MomentEllipsoid:
    """Compute the ellipsoid of second moments. samples: (n, 3), m/s^2, in the test direction's frame; their mean is
    subtracted (gravity, sensor offset). Raises ValueError where they are constant."""
    centred_mps2 = samples - samples.mean(axis=0)
    mean_square = centred_mps2.T @ centred_mps2 / len(centred_mps2)
    eigenvalues, eigenvectors = np.linalg.eigh(mean_square)
    if eigenvalues[-1] <= 0.0:
        raise ValueError("the response does not move at all: there is no ellipsoid")
    semi_axes_mps2 = np.sqrt(np.maximum(eigenvalues[::-1], 0.0))
    tilt_deg, turn_deg = _compute_axis_angles_deg(eigenvectors[:, -1])
    return MomentEllipsoid(
        mean_square=tuple(tuple(float(entry) for entry in row) for row in mean_square),
        semi_axes_mps2=(float(semi_axes_mps2[0]), float(semi_axes_mps2[1]), float(semi_axes_mps2[2])),
        tilt_deg=tilt_deg,
        turn_deg=turn_deg,
    )


def compute_phasor_ellipse(samples: FloatArray, sample_rate_hz: float, frequency_hz: float) -> PhasorEllipse:
    """Compute the ellipse of the acceleration's fundamental. samples: (n, 3), m/s^2, in the test direction's frame.
    Raises ValueError for less than one period, or where nothing moves at this frequency."""
    harmonic_count = max(1, min(MOST_HARMONICS, math.ceil(sample_rate_hz / 2 / frequency_hz) - 1))
    phasors = estimate_phasors(samples, sample_rate_hz, frequency_hz, harmonic_count)
    fundamental = phasors[0]
    # Re(p exp(i phi)) over all phi is the image of the unit circle under the matrix [Re p, -Im p]: the semi-axes of
    # the ellipse are the singular values of that matrix, along its left singular vectors.
    directions, semi_axes_mps2, _ = np.linalg.svd(
        np.column_stack([fundamental.real, -fundamental.imag]), full_matrices=False
    )
    if semi_axes_mps2[0] <= 0.0:
        raise ValueError("the response does not move at all: there is no ellipse")
    tilt_deg, turn_deg = _compute_axis_angles_deg(directions[:, 0])
    on_axis_mps2, off_axis_mps2 = abs(fundamental[0]), float(np.linalg.norm(fundamental[1:]))
    squared_amplitudes = np.sum(np.abs(phasors) ** 2, axis=1)
    return PhasorEllipse(
        semi_axes_mps2=(float(semi_axes_mps2[0]), float(semi_axes_mps2[1])),
        tilt_deg=tilt_deg,
        turn_deg=turn_deg,
        ellipticity=float(semi_axes_mps2[1] / semi_axes_mps2[0]),
        on_axis_mps2=float(on_axis_mps2),
        off_axis_ratio=float(off_axis_mps2 / on_axis_mps2) if on_axis_mps2 > 0 else None,
        harmonic_share=float(squared_amplitudes[1:].sum() / squared_amplitudes[0]),
    )


def _compute_segment_ellipsoid(
    samples: FloatArray, sample_rate_hz: float, segment: Segment, description: dict[str, Any]
) -> EllipsoidResult:
    """Compute the ellipsoids of one segment. samples: (n, 3), m/s^2, in the device's frame. description: its entry of
    meta["segments"]. Raises ValueError where the segment is shorter than one period."""
    frequency_hz = float(description["frequency_hz"])
    frame_samples_mps2 = samples @ compute_direction_frame(np.asarray(description["unit_vector"], dtype=np.float64)).T
    # 1e-9: a whole number of periods is not rounded down by a rounding error.
    period_count = int(len(frame_samples_mps2) * frequency_hz / sample_rate_hz + 1e-9)
    if period_count < 1:
        raise ValueError(f"the sinusoid of {frequency_hz:g} Hz is shorter than one period")
    return EllipsoidResult(
        frequency_hz=frequency_hz,
        along=str(description["along"]),
        amplitude_n=segment.amplitude,
        # Only whole periods: a partial period would bias the mean squares.
        moments=compute_moment_ellipsoid(frame_samples_mps2[: round(period_count * sample_rate_hz / frequency_hz)]),
        phasor=compute_phasor_ellipse(frame_samples_mps2, sample_rate_hz, frequency_hz),
    )


def _read_segment_descriptions(recording: Recording) -> Sequence[dict[str, Any]]:
    """Read the entries of meta["segments"]. Raises ValueError unless there is one per segment, complete for
    sinusoids."""
    descriptions = recording.meta.get("segments")
    if not isinstance(descriptions, Sequence) or len(descriptions) != len(recording.segments):
        raise ValueError(
            'meta["segments"] must describe each of the '
            f"{len(recording.segments)} segments in order (frequency_hz, along, unit_vector)"
        )
    for segment_number, (segment, description) in enumerate(
        zip(recording.segments, descriptions, strict=True), start=1
    ):
        missing_keys = [key for key in ("frequency_hz", "along", "unit_vector") if key not in description]
        if segment.kind == "sine" and missing_keys:
            raise ValueError(f'meta["segments"]: segment {segment_number} (sine) lacks {", ".join(missing_keys)}')
    return descriptions


def _compute_axis_angles_deg(axis: FloatArray) -> tuple[float, float]:
    """Compute the tilt of an axis (a line without sign) from the first axis, and its signed angle when projected on the
    first two axes, both in degrees. axis: (3,)"""
    tilt_deg = math.degrees(math.atan2(float(np.linalg.norm(axis[1:])), abs(float(axis[0]))))
    sign = 1.0 if axis[0] >= 0 else -1.0
    turn_deg = math.degrees(math.atan2(sign * float(axis[1]), sign * float(axis[0])))
    return tilt_deg, turn_deg
