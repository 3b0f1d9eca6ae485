import math

import numpy as np
import pytest

from analysis.figures.ellipsoids import draw_ellipsoids
from analysis.psychophysics.ellipsoid import EllipsoidResult, compute_moment_ellipsoid, compute_phasor_ellipse

RATE = 1000.0


def result(frequency_hz: float, tilt_deg: float, along: str = "direction_1") -> EllipsoidResult:
    angle = math.radians(tilt_deg)
    phasor = np.array([math.cos(angle) - 0.2j * math.sin(angle), math.sin(angle) + 0.2j * math.cos(angle), 0.0])
    wave = np.exp(2j * np.pi * frequency_hz * np.arange(2000) / RATE)
    samples = np.real(phasor[None, :] * wave[:, None])
    return EllipsoidResult(
        frequency_hz, along, 1.0, compute_moment_ellipsoid(samples), compute_phasor_ellipse(samples, RATE, frequency_hz)
    )


def test_both_definitions_are_drawn_for_every_frequency():
    figure = draw_ellipsoids([result(f, 10.0) for f in (5.0, 25.0, 35.0)])
    titles = [axes.get_title() for axes in figure.axes]
    assert titles == [
        *(f"{f} Hz\nmean squares\n1 : 0.20, tilt 10°" for f in (5, 25, 35)),
        *["phasors\n1 : 0.20, tilt 10°"] * 3,
    ]


@pytest.mark.parametrize("tilt_deg", [30.0, -40.0])
def test_the_drawn_ellipse_has_the_axes_and_the_turn_of_the_result(tilt_deg):
    figure = draw_ellipsoids([result(15.0, tilt_deg)])
    for axes in figure.axes:
        x, y = axes.lines[-1].get_data()
        radius = np.hypot(x, y)
        longest = int(np.argmax(radius))
        assert (radius.max(), radius.min()) == pytest.approx((1.0, 0.2), abs=1e-3)
        turn = math.degrees(math.atan(y[longest] / x[longest]))
        assert turn == pytest.approx(tilt_deg, abs=2.1)


def test_two_directions_share_a_panel_and_differ_in_dash():
    figure = draw_ellipsoids([result(15.0, 10.0), result(15.0, -10.0, "direction_2")])
    first, second = figure.axes[0].lines[-2:]
    assert first.get_linestyle() != second.get_linestyle()
    assert first.get_color() != second.get_color()
    assert figure.axes[0].get_title() == "15 Hz\nmean squares"


def test_many_frequencies_continue_in_further_lines():
    figure = draw_ellipsoids([result(float(f), 5.0) for f in range(5, 45, 5)])
    assert len(figure.axes) == 24
    assert sum(bool(axes.get_title()) for axes in figure.axes) == 16
