"""What an order buys and costs."""

import numpy as np
import pytest

from equalizer.identification.state_space.order_report import (
    compare_orders,
    count_dense_products,
    count_products,
)


@pytest.fixture(scope="module")
def report(plants, measuring):
    plant = measuring.small_plant(plants)
    return compare_orders(measuring.noisy(plant, np.arange(4.6, 38, 0.05), 0.3, 4), orders=(8, 4, 6, 12))


def test_the_true_order_is_seen_and_suggested(report):
    assert report.visible_order == 6
    assert report.suggested_order == 6


def test_too_low_an_order_shows_on_lines_that_were_held_out(report):
    rows = {row.order: row for row in report.rows}
    assert list(rows) == [4, 6, 8, 12]
    assert rows[4].held_out_cost > 3
    assert rows[6].held_out_cost == pytest.approx(1.0, abs=0.1)
    assert rows[6].held_out_error == pytest.approx(report.held_out_noise, rel=0.1)


def test_a_tick_costs_what_its_matrices_cost(report):
    assert report.rows[1].multiply_adds_per_tick == count_products(6, 3, 3) == 9 + 36 + 9
    assert count_dense_products(26, 3, 3) == 26 * 26 + 26 * 6 + 9


def test_the_share_done_is_reported(plants, measuring):
    heard: list[float] = []
    response = measuring.noisy(measuring.small_plant(plants), np.arange(4.6, 38, 0.2), 0.3, 4)
    compare_orders(response, orders=(4, 6), on_progress=heard.append)
    assert heard == [0.0, 0.5, 1.0]
