from dataclasses import replace

import numpy as np
import pytest

from analysis.look.overview import make_overview
from equalizer.signals.recording import Recording, Segment


def test_an_intact_recording_has_no_findings(clean_recording):
    found = make_overview("sound", clean_recording)
    assert not [check for check in found.checks if check.level == "wrong"]
    assert [check.finding for check in found.checks if check.level == "notice"] == [
        "Nothing repeats, so noise cannot be distinguished from errors of a model."
    ]
    assert [(band.command, round(band.low_hz)) for band in found.bands] == [("f1", 0)]
    assert found.coherences[0].share > 0.95
    assert found.pairs[0].agreement.gain == pytest.approx(1.0, rel=0.01)


def test_what_is_wrong_comes_first(clean_recording):
    spoiled = clean_recording.response.samples.copy()
    spoiled[100:5100] = np.nan
    found = make_overview(
        "spoiled", replace(clean_recording, response=replace(clean_recording.response, samples=spoiled))
    )
    assert found.checks[0].level == "wrong"
    order = [("wrong", "notice", "fine").index(check.level) for check in found.checks]
    assert order == sorted(order)


@pytest.mark.parametrize("n", [1, 2, 3, 20, 40, 100])
@pytest.mark.parametrize("fill", ["noise", "zero", "missing"])
def test_a_recording_of_any_length_can_be_looked_at(make_recording, n, fill):
    made = {"noise": np.random.default_rng(1).standard_normal((n, 2)), "zero": np.zeros((n, 2))}
    samples = made.get(fill, np.full((n, 2), np.nan))
    segments = (Segment(0, n, "noise", 1.0, 10),)
    found = make_overview("short", make_recording(samples, samples[::-1], position=samples, segments=segments))
    assert isinstance(found.recording, Recording)
    assert len(found.summaries) == 6
    assert all(check.finding.endswith(".") for check in found.checks)


def test_without_spectra_no_command_is_called_undriven(make_recording, make_noise):
    response = make_noise(2000)
    response[::10] = np.nan
    overview = make_overview("gaps.h5", make_recording(make_noise(2000, seed=2), response))
    assert overview.spectra is None
    assert not any("is not driven" in check.finding for check in overview.checks)


def test_signals_and_segments_that_do_not_fit_together_are_refused(make_recording, make_noise):
    made = make_recording(make_noise(200), make_noise(201), segments=(Segment(0, 300, "noise"),))
    with pytest.raises(ValueError, match="bad cannot be examined: command has 200 samples, .*; segment 1 stops at 300"):
        make_overview("bad", made)
