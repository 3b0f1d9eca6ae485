import numpy as np
import pytest

from analysis.figures.frequency_bands import draw_frequency_bands, make_frequency_bands_picture
from equalizer.identification.frequency_response.coupling_onset import CouplingOnset, find_coupling_onset
from equalizer.identification.frequency_response.frequency_bands import compute_frequency_bands
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse

LINES = np.arange(1, 15000) / 30.0


@pytest.fixture
def response() -> FrequencyResponse:
    """Coupling grows with frequency and reaches a quarter at 12 Hz."""
    exact = np.tile(np.eye(2, dtype=complex), (len(LINES), 1, 1))
    exact[:, 1, 0] = 0.25 * LINES / 12.0
    shape = exact.shape
    return FrequencyResponse(
        LINES, exact, np.full(shape, 1e-6), np.ones(shape[:2]), LINES > 4, 1000.0, ("fx", "fy"), ("ax", "ay")
    )


def figure_texts(figure) -> list[str]:
    return [text.get_text() for axes in figure.axes for text in axes.texts]


def test_device_person_and_methods_stand_below_each_other(response):
    onset = find_coupling_onset(response)
    figure = draw_frequency_bands(response, onset, compute_frequency_bands(onset.frequency_hz), 35.0)
    words = figure_texts(figure)
    for expected in ("25 %", "coupling begins: 12.0 Hz", "axes couple", "directions are felt", "hardly felt"):
        assert expected in words
    assert [word.split("\n")[0] for word in words if "\n" in word] == ["low", "middle", "high"]
    assert [label.get_text() for label in figure.axes[1].get_yticklabels()] == ["Device", "Person", "Driven by"]


@pytest.mark.slow
def test_the_mark_lies_where_the_curve_passes_the_threshold(response):
    onset = find_coupling_onset(response)
    axes = draw_frequency_bands(response, onset, compute_frequency_bands(onset.frequency_hz), 35.0).axes[0]
    curve = axes.lines[0]
    (mark,) = [line for line in axes.lines if line.get_marker() == "o"]
    assert np.interp(mark.get_xdata()[0], curve.get_xdata(), curve.get_ydata()) == pytest.approx(25.0, abs=0.2)


def test_without_coupling_there_are_two_bands_and_no_mark(response):
    none = CouplingOnset(None, None, False, 0.25, "a rule")
    figure = draw_frequency_bands(response, none, compute_frequency_bands(None), 35.0)
    words = figure_texts(figure)
    assert not any(word.startswith(("middle", "coupling begins")) for word in words)
    assert "axes couple" not in words


def test_coupled_from_the_start_is_written(response):
    start = CouplingOnset(4.0, None, True, 0.25, "a rule")
    assert "coupled from the start" in figure_texts(
        draw_frequency_bands(response, start, compute_frequency_bands(4.0), 35.0)
    )


def test_the_caption_states_the_rule_and_why_each_band_is_driven_so(response):
    onset = find_coupling_onset(response)
    picture = make_frequency_bands_picture(response, onset, compute_frequency_bands(onset.frequency_hz), 35.0)
    assert onset.rule in picture.caption
    assert "Middle: Directions are felt, but the device mixes its axes." in picture.caption
