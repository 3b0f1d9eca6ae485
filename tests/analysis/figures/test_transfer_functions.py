from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex

from analysis.figures.picture import render_picture_svg
from analysis.figures.style import BLUE, ORANGE, VERMILLION
from analysis.figures.transfer_functions import ResponseCurve, draw_transfer_functions, make_transfer_functions_picture
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse

LINES = np.arange(1, 15000) / 30.0


@pytest.fixture
def response() -> FrequencyResponse:
    """Axes of gains 1, 2 and 3, off axis a tenth; reliable from 4 to 300 Hz."""
    gains = np.diag([1.0, 2.0, 3.0]) + 0.1 * (1 - np.eye(3))
    return FrequencyResponse(
        LINES,
        np.tile(gains.astype(complex), (len(LINES), 1, 1)),
        np.full((len(LINES), 3, 3), 0.02**2),
        np.ones((len(LINES), 3)),
        (LINES > 4) & (LINES < 300),
        1000.0,
        ("fx", "fy", "fz"),
        ("ax", "ay", "az"),
        remarks=("Below 4 Hz nothing is known.",),
    )


def curves(axes, colour):
    return [line for line in axes.lines if to_hex(line.get_color()) == colour.lower()]


def test_every_input_has_a_panel_for_every_output(response):
    figure = draw_transfer_functions(response)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles == [f"{force} → {output}" for output in ("ax", "ay", "az") for force in ("fx", "fy", "fz")]
    assert figure.get_supylabel() == "Magnitude (m/s² per N)"
    assert figure.get_supxlabel() == "Frequency (Hz)"


def test_a_panel_shows_its_own_entry_and_its_noise(response):
    figure = draw_transfer_functions(response)
    for panel, gain in ((0, 1.0), (1, 0.1), (4, 2.0), (8, 3.0)):
        (measured,) = curves(figure.axes[panel], BLUE)
        (floor,) = curves(figure.axes[panel], ORANGE)
        assert np.nanmax(measured.get_ydata()) == pytest.approx(gain)
        assert np.allclose(floor.get_ydata(), 0.02)


def test_lines_that_are_not_reliable_are_grey(response):
    figure = draw_transfer_functions(response)
    (measured,) = curves(figure.axes[0], BLUE)
    coloured = measured.get_xdata()[np.isfinite(measured.get_ydata())]
    assert 3.9 < coloured.min() < 4.3
    assert 290 < coloured.max() < 312
    assert "not reliable" in [text.get_text() for text in figure.legends[0].get_texts()]


@pytest.mark.slow
def test_a_model_and_a_band_are_laid_over(response):
    model = ResponseCurve("model of order 26", LINES[150:900], 1.1 * response.response[150:900])
    figure = draw_transfer_functions(response, model, (5.0, 35.0))
    (drawn,) = curves(figure.axes[4], VERMILLION)
    assert np.allclose(drawn.get_ydata(), 2.2)
    said = [text.get_text() for text in figure.legends[0].get_texts()]
    assert said[-2:] == ["model of order 26", "5 to 35 Hz"]


def test_the_caption_says_what_the_estimate_says_of_itself(response):
    picture = make_transfer_functions_picture(response)
    assert picture.name == "transfer-functions"
    assert picture.caption.endswith("Below 4 Hz nothing is known.")


@pytest.mark.slow
def test_fifteen_thousand_lines_are_no_burden_for_a_page(response):
    assert len(render_picture_svg(make_transfer_functions_picture(response))) < 1_000_000


def test_no_line_draws_a_sentence(response):
    figure = draw_transfer_functions(response.select_band(600.0, 700.0))
    assert [text.get_text() for text in figure.texts] == ["There is no line to draw."]


def test_a_response_below_1_hz_is_shown_whole(response):
    figure = draw_transfer_functions(replace(response, frequency_hz=LINES / 1000))
    assert figure.axes[0].get_xlim() == pytest.approx((1 / 30_000, 0.499), rel=0.03)
    assert figure.axes[0].get_ylim()[1] == pytest.approx(6.0)
