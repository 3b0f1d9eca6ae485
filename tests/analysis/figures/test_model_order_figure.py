"""The figure of the order report."""

import numpy as np
import pytest

from analysis.figures.model_order import make_model_order_picture
from equalizer.identification.state_space.order_report import OrderReport, OrderRow


@pytest.fixture
def report():
    rows = tuple(OrderRow(order, 1.0, 0.05 / order, 10 * order, order**2) for order in (10, 14, 20))
    return OrderReport(np.array([100.0, 30.0, 5.0, 1.1, 0.9]), 3, rows, 0.002, 14)


def test_the_caption_names_the_order_and_the_one_that_would_do(report):
    assert (
        "This model has order 20; of those tried, the lowest that is as good as the best is 14."
        in make_model_order_picture(report, 20).caption
    )


def test_seen_and_noise_are_two_kinds_of_points_and_both_costs_are_drawn(report):
    left, right, cost = make_model_order_picture(report, 20).figure.axes
    seen, noise = left.lines[:2]
    assert (len(seen.get_xdata()), len(noise.get_xdata())) == (3, 2)
    assert list(right.lines[0].get_ydata()) == pytest.approx([0.5, 5 / 14, 0.25])
    assert list(cost.lines[0].get_ydata()) == [100, 140, 200]
