import json
import math
from dataclasses import asdict, replace

import numpy as np
import pytest

from analysis.psychophysics.ellipsoid import (
    compute_direction_frame,
    compute_ellipsoids,
    compute_moment_ellipsoid,
    compute_phasor_ellipse,
    read_sensor_frame,
)
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal

RATE = 1000.0
UP_LEFT = np.array([0.0, -math.sqrt(0.5), math.sqrt(0.5)])


def tone(phasor, frequency_hz, n=2000):
    """(n, 3) samples of Re(p exp(i 2 pi f t)), p in the frame of the test direction."""
    t = np.arange(n) / RATE
    return np.real(np.asarray(phasor)[None, :] * np.exp(2j * np.pi * frequency_hz * t)[:, None])


def record_sinusoids(parts, frequencies, unit_vector=UP_LEFT):
    """Segments of sinusoids one after another with rest between, in the device frame."""
    frame = compute_direction_frame(unit_vector)
    pieces, segments, described, at = [], [], [], 0
    for part, frequency in zip(parts, frequencies, strict=True):
        pieces += [part @ frame, np.zeros((100, 3))]
        segments.append(Segment(at, at + len(part), "sine", amplitude=1.0))
        described.append({"frequency_hz": frequency, "along": "direction_1", "unit_vector": unit_vector.tolist()})
        at += len(part) + 100
    samples = np.concatenate(pieces)
    return Recording(
        device="synthetic",
        command=Signal(np.zeros_like(samples), RATE, "force", "N", ("fx", "fy", "fz")),
        response=Signal(samples, RATE, "acceleration", "m/s^2", ("ax", "ay", "az")),
        segments=tuple(segments),
        meta={"segments": described},
    )


def test_the_frame_is_right_handed_and_spans_the_plane_of_the_direction():
    frame = compute_direction_frame(UP_LEFT)
    assert frame @ frame.T == pytest.approx(np.eye(3))
    assert np.linalg.det(frame) == pytest.approx(1.0)
    assert frame[0] == pytest.approx(UP_LEFT)
    assert np.abs(frame[2]) == pytest.approx([1.0, 0.0, 0.0])


@pytest.mark.parametrize("vector", [(0.0, 0.0, 2.0), (1.0, 0.0)])
def test_a_direction_that_is_no_unit_vector_is_refused(vector):
    with pytest.raises(ValueError, match="unit_vector must be three numbers of norm 1"):
        compute_direction_frame(np.array(vector))


def test_motion_along_the_direction_alone_is_a_line_without_tilt():
    (result,) = compute_ellipsoids(record_sinusoids([tone([2.0, 0.0, 0.0], 15.0)], [15.0]))
    assert result.moments.semi_axes_mps2 == pytest.approx((math.sqrt(2.0), 0.0, 0.0), abs=1e-7)
    assert result.moments.normalised_axes == pytest.approx((1.0, 0.0), abs=1e-7)
    assert result.phasor.semi_axes_mps2 == pytest.approx((2.0, 0.0), abs=1e-9)
    assert (result.phasor.tilt_deg, result.phasor.off_axis_ratio) == pytest.approx((0.0, 0.0), abs=1e-6)


def test_coupling_in_phase_tilts_the_line():
    (result,) = compute_ellipsoids(record_sinusoids([tone([1.0, math.tan(math.radians(20.0)), 0.0], 25.0)], [25.0]))
    assert result.phasor.tilt_deg == pytest.approx(20.0)
    assert result.phasor.turn_deg == pytest.approx(20.0)
    assert result.moments.turn_deg == pytest.approx(20.0)
    assert result.phasor.ellipticity == pytest.approx(0.0, abs=1e-9)


def test_a_negative_coupling_turns_the_other_way():
    (result,) = compute_ellipsoids(record_sinusoids([tone([-1.0, 0.5, 0.0], 25.0)], [25.0]))
    assert result.phasor.turn_deg == pytest.approx(-math.degrees(math.atan(0.5)))


def test_coupling_a_quarter_period_late_widens_the_ellipse_without_tilt():
    (result,) = compute_ellipsoids(record_sinusoids([tone([1.0, 0.4j, 0.0], 35.0)], [35.0]))
    assert result.phasor.ellipticity == pytest.approx(0.4)
    assert result.phasor.tilt_deg == pytest.approx(0.0, abs=1e-6)
    assert result.moments.normalised_axes[1] == pytest.approx(0.4)


def test_a_random_ellipse_in_space_is_recovered():
    generator = np.random.default_rng(3)
    phasor = generator.normal(size=3) + 1j * generator.normal(size=3)
    result = compute_phasor_ellipse(tone(phasor, 45.0), RATE, 45.0)
    # Oracle: the extreme radii of the traced curve itself.
    turns = np.exp(1j * np.linspace(0, 2 * np.pi, 20_001))
    radius = np.linalg.norm(np.real(phasor[None, :] * turns[:, None]), axis=1)
    assert result.semi_axes_mps2 == pytest.approx((radius.max(), radius.min()), rel=1e-6)
    assert result.off_axis_ratio == pytest.approx(np.linalg.norm(phasor[1:]) / abs(phasor[0]))


def test_harmonics_are_distinguished_from_the_fundamental():
    samples = tone([2.0, 0.0, 0.0], 15.0) + tone([0.0, 0.6, 0.0], 45.0)
    clean, distorted = (
        compute_phasor_ellipse(tone([2.0, 0, 0], 15.0), RATE, 15.0),
        compute_phasor_ellipse(samples, RATE, 15.0),
    )
    assert distorted.harmonic_share == pytest.approx(0.36 / 4.0)
    assert clean.harmonic_share == pytest.approx(0.0, abs=1e-12)
    assert distorted.off_axis_ratio == pytest.approx(0.0, abs=1e-9)
    assert compute_moment_ellipsoid(samples).normalised_axes[1] == pytest.approx(0.3)


def test_noise_rounds_the_moments_and_leaves_the_phasors():
    noise = np.random.default_rng(9).normal(0.0, 0.5, (4000, 3))
    samples = tone([1.0, 0.0, 0.0], 15.0, n=4000) + noise
    # Mean squares: 0.5 + 0.25 along, 0.25 across; so the second axis reads 0.58 although nothing moves there.
    assert compute_moment_ellipsoid(samples).normalised_axes[1] == pytest.approx(math.sqrt(0.25 / 0.75), rel=0.05)
    result = compute_phasor_ellipse(samples, RATE, 15.0)
    assert result.ellipticity < 0.04
    assert result.off_axis_ratio < 0.05


def test_gravity_and_offset_are_no_motion():
    samples = tone([1.0, 0.2, 0.0], 15.0) + np.array([0.0, 0.0, 9.81])
    result = compute_moment_ellipsoid(samples)
    assert result.semi_axes_mps2[2] == pytest.approx(0.0, abs=1e-2)


def test_a_turned_sensor_is_turned_back():
    recording = record_sinusoids([tone([1.0, 0.3, 0.1j], 25.0)], [25.0])
    sensor_to_device = compute_direction_frame(np.array([0.36, 0.48, 0.8]))
    felt = recording.response
    turned = replace(recording, response=replace(felt, samples=felt.samples @ sensor_to_device))
    (expected,), (result,) = compute_ellipsoids(recording), compute_ellipsoids(turned, sensor_to_device)
    assert result.phasor.semi_axes_mps2 == pytest.approx(expected.phasor.semi_axes_mps2)
    assert result.phasor.tilt_deg == pytest.approx(expected.phasor.tilt_deg)


def test_one_result_per_sinusoid_in_the_order_played():
    recording = record_sinusoids([tone([1.0, 0, 0], f) for f in (25.0, 5.0, 25.0)], (25.0, 5.0, 25.0))
    assert [result.frequency_hz for result in compute_ellipsoids(recording)] == [25.0, 5.0, 25.0]


def test_a_harmonic_above_half_the_rate_is_not_asked_for():
    assert compute_phasor_ellipse(tone([1.0, 0, 0], 300.0), RATE, 300.0).harmonic_share == 0.0


def test_a_result_is_json():
    results = compute_ellipsoids(record_sinusoids([tone([1.0, 0.1, 0], 5.0)], [5.0]))
    assert json.loads(json.dumps([asdict(result) for result in results], allow_nan=False))[0]["along"] == "direction_1"


@pytest.fixture
def recording():
    return record_sinusoids([tone([1.0, 0.1, 0.0], 15.0)], [15.0])


def test_a_response_that_is_no_acceleration_is_refused(recording):
    positions = replace(recording.response, quantity="position", unit="m")
    with pytest.raises(ValueError, match="needs a response of 3 accelerations, not 3 channels of position"):
        compute_ellipsoids(replace(recording, response=positions))


def test_missing_values_are_refused_by_segment(recording):
    samples = recording.response.samples.copy()
    samples[7, 1] = np.nan
    with pytest.raises(ValueError, match=r"segment 1 \(sine\): the response has missing values"):
        compute_ellipsoids(replace(recording, response=replace(recording.response, samples=samples)))


def test_segments_without_a_description_are_refused(recording):
    with pytest.raises(ValueError, match="must describe each of the 1 segments"):
        compute_ellipsoids(replace(recording, meta={}))
    with pytest.raises(ValueError, match=r"segment 1 \(sine\) lacks along, unit_vector"):
        compute_ellipsoids(replace(recording, meta={"segments": [{"frequency_hz": 15.0}]}))


def test_a_sensor_that_is_turned_is_turned_back():
    quarter = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    played = record_sinusoids([tone([2.0, 0.0, 0.0], 15.0)], [15.0])
    read = replace(played.response, samples=played.response.samples @ np.array(quarter))
    turned = replace(played, response=read, meta={**played.meta, "sensor": {"frame_to_device": quarter}})
    assert compute_ellipsoids(turned, read_sensor_frame(turned))[0].phasor.tilt_deg == pytest.approx(0.0, abs=1e-6)
    assert compute_ellipsoids(turned)[0].phasor.tilt_deg > 40
    assert read_sensor_frame(played) is None


@pytest.mark.parametrize(
    ("stated", "cause"),
    [
        ([[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]], "not a rotation"),
        ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], r"shape \(2, 3\)"),
        ({"x": 1.0}, "not a matrix of numbers"),
        ([[float("nan")] * 3] * 3, "not a rotation"),
        ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]], "a reflection"),
    ],
)
def test_what_is_no_rotation_of_the_sensor_is_refused(recording, stated, cause):
    with pytest.raises(ValueError, match=cause):
        read_sensor_frame(replace(recording, meta={**recording.meta, "sensor": {"frame_to_device": stated}}))


def test_a_recording_without_sinusoids_is_refused(recording):
    with pytest.raises(ValueError, match="no segment of kind sine"):
        compute_ellipsoids(replace(recording, segments=(replace(recording.segments[0], kind="sweep"),)))


def test_less_than_a_period_is_refused(recording):
    short = (replace(recording.segments[0], stop=50),)
    with pytest.raises(ValueError, match="the sinusoid of 15 Hz is shorter than one period"):
        compute_ellipsoids(replace(recording, segments=short))


def test_a_dead_sensor_is_refused(recording):
    still = replace(recording.response, samples=np.zeros_like(recording.response.samples))
    with pytest.raises(ValueError, match="does not move at all: there is no ellipsoid"):
        compute_ellipsoids(replace(recording, response=still))
    with pytest.raises(ValueError, match="does not move at all: there is no ellipse"):
        compute_phasor_ellipse(np.zeros((1000, 3)), RATE, 15.0)
