"""A motor that runs one way in each take: what a friction differs by from take to take lies at frequency zero."""

from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.first_model.model_from_balance import compute_law_power_share

RATE_HZ, SAMPLES = 100.0, 1000


def make_balance(*courses):
    """A balance with one named law, whose force in each take is a course."""
    regression = SimpleNamespace(
        select_columns=lambda laws: list(laws), fit_weights=lambda columns: np.ones(1), base_column_count=0,
        column_ranges=[slice(0, 1)],
        columns=[course[:, None] for course in courses],
        motions=[SimpleNamespace(step=1, rate_hz=RATE_HZ) for _ in courses],
    )  # fmt: skip
    return SimpleNamespace(search=SimpleNamespace(regression=regression), named=[SimpleNamespace(law_index=0)])


@pytest.mark.parametrize(
    ("levels", "share"), [((1.0, -1.0), 1 / (1 + 0.1**2)), ((1.0, 1.0), 0.0)], ids=["both ways", "one way"]
)
def test_only_a_law_that_differs_between_takes_has_power_below_their_band(levels, share):
    ripple = 0.1 * np.where(np.arange(SAMPLES) % 2, 1.0, -1.0)
    assert compute_law_power_share([make_balance(*(level + ripple for level in levels))], 2.0) == pytest.approx(
        share, abs=1e-6
    )
