from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.data.observed_parts import cut_part
from analysis.diagnosis.data.spectral_lines import compute_hold_samples, find_detection_lines
from analysis.diagnosis.limits import DISTORTION_P
from analysis.diagnosis.localisation.distortion import find_distortions
from analysis.diagnosis.localisation.level_trends import compute_level_trends
from analysis.diagnosis.noise.noise_floor import estimate_noise_floor


def distortions_of(recording):
    return find_distortions([recording], [estimate_noise_floor(recording)])


def whole_band_trends(trends, output, input):
    return {t.kind: t for t in trends if t.whole_band and t.output == output and t.input == input}


def test_a_clean_device_has_no_distortion(device):
    cells = distortions_of(device().recorded()).cells
    assert len(cells) > 200
    assert np.mean([cell.p_value < 0.05 for cell in cells]) < 0.08
    assert not any(trend.present for trend in compute_level_trends(cells))


def test_invented_odd_distortion_is_recovered_with_its_size(device):
    bench = device(cubic=0.02, levels=(1.0, 2.0, 4.0), noise=0.01, axes=1)
    cells = [c for c in distortions_of(bench.recorded()).cells if c.whole_band and c.quantity == "acceleration"]
    for cell in (c for c in cells if c.kind == "odd"):
        command, segments = bench.command(1)
        segment = next(s for s in segments if s.amplitude == cell.amplitude)
        clean = bench.linear(command, segments)[0][segment.start : segment.start + 1000, 0]
        extra = np.fft.rfft(0.02 * clean**3) / 1000
        silent = np.setdiff1d(
            np.arange(3, 200, 2),
            np.flatnonzero(np.abs(np.fft.rfft(command[segment.start : segment.start + 1000, 0])) > 1),
        )
        inside = silent[(silent > 3) & (silent < 199)]
        expected = np.sqrt(2 * np.mean(np.abs(extra[inside]) ** 2) * 128)
        assert cell.p_value < DISTORTION_P
        assert cell.rms == pytest.approx(expected, rel=0.1)
    assert all(c.p_value > DISTORTION_P for c in cells if c.kind in ("even", "varying"))


def test_odd_distortion_that_rises_is_distinguished_from_friction_that_falls(device):
    rising = whole_band_trends(
        compute_level_trends(distortions_of(device(cubic=0.02, axes=1).recorded()).cells), "ax", "fx"
    )
    falling = whole_band_trends(
        compute_level_trends(distortions_of(device(coulomb=0.3, axes=1).recorded()).cells), "ax", "fx"
    )
    assert rising["odd"].level_dependence in ("rises", "rises from nothing")
    assert falling["odd"].level_dependence == "falls"
    assert falling["odd"].db_per_doubling == pytest.approx(-6, abs=1.5)
    assert not rising["even"].present
    assert not falling["even"].present


def test_even_distortion_falls_on_even_lines(device):
    found = whole_band_trends(
        compute_level_trends(distortions_of(device(square=0.05, axes=1).recorded()).cells), "ax", "fx"
    )
    assert found["even"].present
    assert found["even"].db_per_doubling == pytest.approx(6, abs=1.5)
    assert not found["odd"].present


def test_a_device_that_sways_varies_between_periods(device):
    found = whole_band_trends(
        compute_level_trends(distortions_of(device(swaying=0.3, axes=1, noise=0.01).recorded()).cells), "ax", "fx"
    )
    assert found["varying"].present
    assert found["varying"].level_dependence == "stays"


def test_a_multisine_without_silent_odd_lines_says_so(device):
    found = distortions_of(device(full=True, cubic=0.02).recorded())
    assert {cell.kind for cell in found.cells} == {"varying"}
    assert any("There are no silent (undriven) lines" in remark for remark in found.remarks)


def test_what_a_recording_cannot_tell_is_reported(device):
    recording = device(levels=(1.0,), axes=1).recorded()
    assert any("one level only" in remark for remark in distortions_of(recording).remarks)
    single = replace(recording, segments=tuple(replace(s, period=0) for s in recording.segments))
    assert "Nothing is periodic" in distortions_of(single).remarks[0]
    bare = distortions_of(replace(recording, position=None))
    assert {cell.quantity for cell in bare.cells} == {"acceleration"}


def test_distortion_that_a_feedback_brings_back_is_not_counted_twice(device):
    recording = device(axes=1, noise=0.005, levels=(2.0,)).recorded()
    at = np.arange(len(recording)) / 1000.0
    driven = np.any(recording.command.samples != 0, axis=1)
    # An even line in the command, which the linear device answers as it answers any.
    extra = np.where(driven, 0.02 * np.sin(2 * np.pi * 40 * at), 0.0)[:, None]
    bench = device(axes=1)
    segments = recording.segments
    answer = bench.linear(extra, segments)[0]
    disturbed = replace(
        recording,
        command=replace(recording.command, samples=recording.command.samples + extra),
        response=replace(recording.response, samples=recording.response.samples + answer),
        excitation=recording.command,
    )
    plain = replace(disturbed, command=recording.command)
    even = [
        c for c in distortions_of(disturbed).cells if c.kind == "even" and c.whole_band and c.quantity == "acceleration"
    ]
    blamed = [
        c for c in distortions_of(plain).cells if c.kind == "even" and c.whole_band and c.quantity == "acceleration"
    ]
    assert blamed[0].p_value < 1e-6
    assert even[0].p_value > 1e-3


def test_images_of_a_held_command_are_no_driven_lines():
    random = np.random.default_rng(5)
    held = np.repeat(random.standard_normal((500, 1)), 2, axis=0)
    assert compute_hold_samples(held) == 2
    assert compute_hold_samples(random.standard_normal((500, 1))) == 1
    driven = find_detection_lines(np.fft.rfft(held, axis=0)[1:500] / 1000, compute_hold_samples(held)).driven
    assert driven[:240].mean() > 0.9
    assert not driven[250:].any()


@pytest.mark.parametrize(
    ("number", "output", "input", "kind", "level_dependence"),
    [
        (1, "ax", "fx", "odd", "falls"),
        (2, "x", "fx", "odd", "rises"),
        (7, "ax", "fx", "odd", "rises from nothing"),
        (8, "ax", "fx", "varying", "stays"),
        (10, "az", "fz", "odd", "falls"),
    ],
)
def test_the_shared_cases_show_the_signature_of_their_effect(shared, number, output, input, kind, level_dependence):
    from study.store.formats.recording_file import read_recording

    found = whole_band_trends(
        compute_level_trends(distortions_of(read_recording(shared / "cases" / f"open-{number:02d}.h5")).cells),
        output,
        input,
    )
    assert found[kind].level_dependence == level_dependence


@pytest.mark.parametrize("number", [0, 4, 5, 6, 9])
def test_linear_shared_cases_have_no_distortion(shared, number):
    from study.store.formats.recording_file import read_recording

    trends = compute_level_trends(distortions_of(read_recording(shared / "cases" / f"open-{number:02d}.h5")).cells)
    assert not any(trend.present for trend in trends)


def test_levels_in_recordings_of_their_own_are_compared_in_any_order(device):
    whole = device(cubic=0.02, levels=(1.0, 2.0, 4.0), axes=1).recorded()
    parts = [cut_part(whole, segment.start, segment.stop) for segment in whole.segments]
    found, reversed_found = (
        find_distortions(recordings, [estimate_noise_floor(recording) for recording in recordings])
        for recordings in (parts, parts[::-1])
    )
    assert {cell.amplitude for cell in found.cells} == {1.0, 2.0, 4.0}
    assert set(found.cells) == set(reversed_found.cells)
    # Each cell has the noise of its own recording.
    noise_rms = [float(estimate_noise_floor(recording).response_rms[0]) for recording in parts]
    assert {cell.noise_rms for cell in found.cells if cell.output == "ax"} == set(noise_rms)
    assert found.remarks == reversed_found.remarks
    assert not any("one level only" in remark for remark in found.remarks)
    trends = whole_band_trends(compute_level_trends(found.cells), "ax", "fx")
    assert trends["odd"].level_dependence in ("rises", "rises from nothing")
