import numpy as np
import pytest
from scipy import signal as sg

from analysis.look.channels import list_channels
from analysis.look.cross_spectra import estimate_cross_spectra
from analysis.look.driven_band import (
    check_coherences,
    check_driven_axes,
    estimate_coherences,
    find_driven_bands,
    find_silent_segments,
)
from equalizer.signals.recording import Segment

RATE_HZ = 1000.0


def analyse_drive(found):
    channels = list_channels(found)
    spectra = estimate_cross_spectra(channels, [(0, len(found))], RATE_HZ)
    bands = find_driven_bands(spectra, channels)
    return bands, estimate_coherences(spectra, channels, bands), spectra


def test_spectra_hold_the_power_of_the_signal(make_recording, make_noise):
    command = make_noise()
    _, _, spectra = analyse_drive(make_recording(command, 2 * command))
    step_hz = spectra.frequency_hz[1] - spectra.frequency_hz[0]
    assert spectra.get_power_density(0).sum() * step_hz == pytest.approx(1.0, rel=0.05)
    assert spectra.get_power_density(1).sum() * step_hz == pytest.approx(4.0, rel=0.05)


@pytest.mark.parametrize(("low_hz", "high_hz"), [(5.0, 35.0), (20.0, 200.0)])
def test_the_driven_band_is_that_of_the_excitation(make_recording, low_hz, high_hz):
    n = 40_000
    lines = np.arange(int(low_hz * n / RATE_HZ), int(high_hz * n / RATE_HZ))
    spectrum = np.zeros(n // 2 + 1, dtype=complex)
    spectrum[lines] = np.exp(2j * np.pi * np.random.default_rng(1).uniform(size=len(lines)))
    command = np.fft.irfft(spectrum, n)
    (band,), _, _ = analyse_drive(make_recording(command / command.std(), command))
    assert (band.low_hz, band.high_hz) == (pytest.approx(low_hz, abs=1.0), pytest.approx(high_hz, abs=1.0))


def test_a_command_that_rests_is_not_driven_and_said(make_recording, make_noise):
    commands = np.column_stack([make_noise(), 1e-4 * make_noise(seed=2)])
    found = make_recording(commands, make_noise())
    bands, _, _ = analyse_drive(found)
    assert [band.command for band in bands] == ["f1"]
    checks = check_driven_axes(found, bands)
    assert (checks[0].level, checks[0].finding) == ("notice", "command 'f2' is not driven.")
    assert "leave it out" in checks[0].advice


def test_the_zero_command_of_a_free_motion_is_to_be_kept(make_recording, make_noise):
    (check,) = check_driven_axes(make_recording(np.zeros(20_000), make_noise()), ())
    assert check.advice.startswith("In a free motion, such as a decay, keep it")


@pytest.mark.parametrize("noise_share", [0.0, 0.2, 0.5])
def test_the_share_that_is_linear_is_found(make_recording, make_noise, noise_share):
    commands = np.column_stack([make_noise(seed=k) for k in (1, 2, 3)])
    through = sg.lfilter([0.2], [1, -0.8], commands @ [1.0, -2.0, 0.5])
    beside = sg.lfilter([0.2], [1, -0.8], make_noise(seed=9))
    ratio = noise_share / (1 - noise_share)
    response = through + np.sqrt(ratio) * beside * through.std() / beside.std()
    _, (found,), _ = analyse_drive(make_recording(commands, response))
    assert found.share == pytest.approx(1 - noise_share, abs=0.04)
    (check,) = check_coherences([found], make_recording(commands, response))
    assert noise_share == 0.2 or check.level == ("fine" if noise_share == 0 else "notice")


def test_another_channel_is_wrong(make_recording, make_noise):
    for kind, level in (("noise", "wrong"), ("step", "notice")):
        other = make_recording(make_noise(seed=1), make_noise(seed=2), segments=(Segment(0, 20_000, kind, 1.0),))
        _, found, _ = analyse_drive(other)
        assert [check.level for check in check_coherences(found, other)] == [level]


def test_a_segment_in_which_no_command_moves_is_named(make_recording, make_noise):
    command = make_noise()
    command[5000:8000] = 0.0
    segments = (Segment(0, 5000, "noise", 3.0), Segment(5000, 8000, "sweep", 1.5), Segment(8000, 9000, "rest"))
    assert find_silent_segments(make_recording(command, command, segments=segments)) == (
        "Segment 2 is a sweep of amplitude 1.5, but no command moves in it.",
    )


def test_a_response_without_power_in_any_window_is_not_fine(make_recording, make_noise):
    """Its only change lies in the last sample, beyond the last window."""
    response = np.append(np.zeros(19_999), 1.0)
    still = make_recording(make_noise(), response, segments=(Segment(0, 20_000, "noise", 1.0),))
    _, found, _ = analyse_drive(still)
    assert (found[0].share, found[0].lowest) == (0.0, 0.0)
    assert [check.level for check in check_coherences(found, still)] == ["wrong"]
