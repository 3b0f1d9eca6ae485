"""What stands out beside the usual error of a model."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.localisation.mismatch_cells import MismatchCell
from analysis.diagnosis.localisation.mismatch_maps import adjust_for_model_error, collect_model_error

LINES, FREEDOM, SNR = 20.0, 2000.0, 1e6
LEVELS, OCTAVES_HZ = (0.5, 1.0, 2.0), (2.0, 4.0, 8.0, 16.0, 32.0, 64.0)


def make_cell(share, level, low_hz, seed_power=1.0):
    """share: rms of the model error over the signal's; noise is a thousandth of the signal."""
    ratio = 1 + seed_power * share**2 * SNR
    return MismatchCell(
        "ax", "acceleration", "fx", (low_hz, 2 * low_hz), level, share * np.sqrt(seed_power), 1.0, np.sqrt(ratio),
        0.002, 0.0, 0.0, 6.0, LINES, FREEDOM, SNR, beyond_noise=True,
    )  # fmt: skip


def draw_cells(share, seed):
    """A model that is off by as much everywhere: the error of each cell is that of a single line."""
    powers = iter(np.random.default_rng(seed).exponential(size=len(LEVELS) * len(OCTAVES_HZ)))
    return [make_cell(share, level, low_hz, next(powers)) for level in LEVELS for low_hz in OCTAVES_HZ]


def test_an_error_that_is_usual_for_the_model_does_not_stand_out():
    found = [
        adjust_for_model_error(cells, collect_model_error(cells))
        for cells in (draw_cells(0.2, seed) for seed in range(40))
    ]
    assert sum(any(each.significant for each in cells) for cells in found) <= 1
    assert all(each.beyond_noise for cells in found for each in cells)
    rate = np.mean([each.p_value < 0.05 for cells in found for each in cells])
    assert 0.005 < rate < 0.06  # the median of a few powers is a little large: on the safe side


@pytest.mark.parametrize("spectrum", [0.05, 0.2])
def test_a_mismatch_at_one_level_and_octave_stands_out(spectrum):
    cells = [make_cell(0.01, level, low_hz) for level in LEVELS for low_hz in OCTAVES_HZ]
    cells[7] = make_cell(10 * spectrum, LEVELS[1], OCTAVES_HZ[1])
    found = [each for each in adjust_for_model_error(cells, collect_model_error(cells)) if each.significant]
    assert [(each.amplitude, each.band_hz[0]) for each in found] == [(1.0, 4.0)]


def test_a_missing_mode_stands_out_in_its_octave_at_all_levels():
    cells = [make_cell(0.6 if low_hz == 32.0 else 0.01, level, low_hz) for level in LEVELS for low_hz in OCTAVES_HZ]
    found = [each for each in adjust_for_model_error(cells, collect_model_error(cells)) if each.significant]
    assert {each.band_hz[0] for each in found} == {32.0}
    assert len(found) == 3


def test_what_a_better_model_has_is_what_a_given_one_is_compared_with():
    given, completed = draw_cells(0.3, 1), draw_cells(0.003, 2)
    found = adjust_for_model_error(given, collect_model_error(completed))
    assert np.mean([each.significant for each in found]) > 0.8


def test_where_nothing_was_held_out_noise_alone_counts():
    cells = [replace(each, p_value=1e-9) for each in draw_cells(0.2, 1)]
    assert all(each.p_value == 1e-9 for each in adjust_for_model_error(cells, collect_model_error([])))
