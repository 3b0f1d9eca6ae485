from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.noise.noise_floor import estimate_noise_floor
from analysis.diagnosis.noise.repeat_noise import _limit_to_rest_noise
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal


def remove_periods(recording: Recording) -> Recording:
    return replace(recording, segments=tuple(replace(s, period=0) for s in recording.segments))


def test_invented_noise_is_recovered_from_repeats(device):
    floor = estimate_noise_floor(device(noise=0.05, position_noise=5e-6).recorded())
    assert floor.method == "repeats"
    assert floor.response_rms == pytest.approx(0.05, rel=0.02)
    assert floor.position_rms == pytest.approx(5e-6, rel=0.02)
    assert floor.response.density.mean(axis=0) == pytest.approx(0.05**2, rel=0.04)
    assert (floor.response.freedom > 5000).all()
    assert not any(any(segment.varies) for segment in floor.response.segments)
    assert not floor.remarks


def test_noise_and_distortion_that_repeats_are_not_confused(device):
    floor = estimate_noise_floor(device(cubic=0.01, square=0.05).recorded())
    assert floor.response_rms == pytest.approx(0.05, rel=0.02)


def test_rounding_is_part_of_the_noise(device):
    fine = estimate_noise_floor(device(position_noise=1e-6, step=1e-5, levels=(1.0, 2.0)).recorded())
    assert fine.position_rms == pytest.approx(np.sqrt(1e-12 + 1e-10 / 12), rel=0.05)
    assert (fine.position.rounding > 0.4 * 1e-10 / 12).all()


def test_a_device_that_varies_does_not_raise_the_floor(device):
    floor = estimate_noise_floor(device(swaying=0.2).recorded())
    assert floor.response_rms == pytest.approx(0.05, rel=0.1)
    assert any(any(segment.varies) for segment in floor.response.segments)
    assert any("differ between periods" in remark for remark in floor.remarks)


def lose_samples(recording):
    lost = np.random.default_rng(5).random(len(recording.response.samples)) < 0.01
    lost[0] = False
    kept = np.maximum.accumulate(np.where(lost, 0, np.arange(len(lost))))
    return replace(recording, response=replace(recording.response, samples=recording.response.samples[kept]))


def test_lines_below_the_noise_at_rest_stay_there_where_segments_vary(device):
    recording = device(rest=3000).recorded()
    density = np.full((500, 2), 10 * 0.05**2)
    density[:250] = 0.01 * 0.05**2
    varied = np.array([True, False])
    floor, above = _limit_to_rest_noise(recording, recording.response.samples, density, np.full(2, 1000.0), varied)
    assert above.tolist() == [True, False]
    assert (floor[:250] == density[:250]).all()
    assert floor[250:, 0] == pytest.approx(0.05**2, rel=0.1)
    assert (floor[:, 1] == density[:, 1]).all()


def test_losses_in_every_segment_do_not_bias_the_noise_at_rest(device):
    recording = device(rest=3000, levels=(1.0, 2.0, 4.0)).recorded()
    floor = estimate_noise_floor(lose_samples(recording))
    assert all(floor.response.more_than_rest)
    assert floor.response_rms == pytest.approx(0.05, rel=0.03)
    assert estimate_noise_floor(recording).response_rms == pytest.approx(0.05, rel=0.03)


def test_a_density_follows_coloured_noise(device):
    recording = device(noise=0.0).recorded()
    white = 0.05 * np.random.default_rng(3).standard_normal(recording.response.samples.shape)
    red = white + np.vstack([np.zeros((1, 2)), white[:-1]])
    floor = estimate_noise_floor(
        replace(recording, response=replace(recording.response, samples=recording.response.samples + red))
    )
    low, high = floor.frequency_hz < 100, floor.frequency_hz > 400
    expected = 0.05**2 * 4 * np.cos(np.pi * floor.frequency_hz / 1000) ** 2
    assert floor.response.density[low].mean() == pytest.approx(expected[low].mean(), rel=0.05)
    assert floor.response.density[high].mean() == pytest.approx(expected[high].mean(), rel=0.1)


def test_without_repeats_noise_is_heard_at_rest(device):
    floor = estimate_noise_floor(remove_periods(device(rest=3000).recorded()))
    assert floor.method == "rest"
    assert floor.response_rms == pytest.approx(0.05, rel=0.03)
    assert "at rest" in floor.remarks[0]


def test_without_repeats_or_rest_noise_is_heard_above_the_driven_band(device):
    floor = estimate_noise_floor(remove_periods(device(rest=0).recorded()))
    assert floor.method == "quiet band"
    assert floor.response_rms == pytest.approx(0.05, rel=0.05)
    assert "above the driven band" in floor.remarks[0]


def test_a_gap_is_not_heard_as_noise():
    random, n = np.random.default_rng(1), 20_000
    slow = np.convolve(random.standard_normal(n), np.hanning(200), "same")[:, None]
    heard = slow / slow.std() + 1e-3 * random.standard_normal((n, 1))
    lost = heard.copy()
    lost[6000:6200] = np.nan
    whole, gap = (
        estimate_noise_floor(
            Recording("gap", Signal(slow, 1000.0, "force", "N", ("fx",)), Signal(each, 1000.0, "position", "m", ("x",)))
        )
        for each in (heard, lost)
    )
    assert whole.method == gap.method == "quiet band"
    assert whole.response_rms == pytest.approx(1e-3, rel=0.1)
    assert gap.response_rms == pytest.approx(1e-3, rel=0.1)


def test_at_a_rate_of_few_samples_per_window_no_rest_is_heard(device):
    found = device(rest=3000).recorded()
    slow = {side: replace(getattr(found, side), sample_rate_hz=4.0) for side in ("command", "response", "position")}
    assert estimate_noise_floor(replace(found, **slow)).method == "repeats"
    assert estimate_noise_floor(remove_periods(replace(found, **slow))).method != "rest"


def test_where_nothing_is_quiet_the_noise_is_not_known():
    random = np.random.default_rng(4)
    command = Signal(random.standard_normal((4000, 1)), 1000.0, "force", "N", ("fx",))
    response = Signal(random.standard_normal((4000, 1)), 1000.0, "acceleration", "m/s^2", ("ax",))
    floor = estimate_noise_floor(Recording("loud", command, response, segments=(Segment(0, 4000, "noise", 1.0),)))
    assert not floor.is_known
    assert np.isnan(floor.response_rms).all()
    assert floor.position_rms is None
    assert "not known" in floor.remarks[0]


@pytest.mark.parametrize("number", [0, 1, 2, 4, 5, 6, 7, 8, 9, 10])
def test_the_noise_of_the_shared_cases_is_found(shared, number):
    from study.store.formats.recording_file import read_recording

    floor = estimate_noise_floor(read_recording(shared / "cases" / f"open-{number:02d}.h5"))
    assert floor.response_rms == pytest.approx([0.042, 0.042, 0.083], rel=0.03)
    assert floor.position_rms == pytest.approx([np.hypot(4e-6, 1e-5 / np.sqrt(12))] * 3, rel=0.03)


def test_rattling_in_every_segment_does_not_pass_for_noise(shared):
    from study.store.formats.recording_file import read_recording

    floor = estimate_noise_floor(read_recording(shared / "cases" / "open-03.h5"))
    assert floor.response_rms == pytest.approx([0.042, 0.042, 0.083], rel=0.05)
    assert "at rest" in " ".join(floor.remarks)


def test_a_reading_that_stands_still_at_rest_does_not_tell_its_noise(device):
    """An encoder's: a noise of zero would make every error infinitely large."""
    recording = remove_periods(device(rest=3000).recorded())
    moving = np.zeros((len(recording), 1), dtype=bool)
    for segment in recording.segments:
        moving[segment.start : segment.stop + 250] = True
    still = replace(recording.response, samples=np.where(moving, recording.response.samples, 0.0))
    floor = estimate_noise_floor(replace(recording, response=still))
    assert floor.method != "rest"
    assert (floor.response.density > 0).all()
