import numpy as np
import pytest

from equalizer.tracking.workspace.band_modes import BandMode
from equalizer.tracking.workspace.mode_matching import ModesDoNotMatchError, compute_modal_assurance, match_modes

BAND = (5.0, 35.0)
SHAPES = np.random.default_rng(4).standard_normal((6, 3))


def mode(natural_hz, shape, share=0.5, factor=1.0):
    residue = factor * np.outer(SHAPES[shape], SHAPES[shape]).astype(complex)
    return BandMode(natural_hz, 0.05, residue, share, 1000.0)


def test_modes_keep_their_partners_when_all_move_past_where_others_were():
    ones = [mode(11.0, 0), mode(13.2, 1), mode(22.5, 2)]
    others = [mode(1.2 * each.natural_hz, k, factor=0.8j) for k, each in enumerate(ones)]
    assert match_modes(ones, others, BAND) == ((0, 0), (1, 1), (2, 2))


def test_modes_that_cross_are_followed_by_their_shape():
    assert match_modes([mode(11.0, 0), mode(12.0, 1)], [mode(11.2, 1), mode(11.8, 0)], BAND) == ((0, 1), (1, 0))


def test_a_weak_mode_and_one_outside_the_band_may_stay_alone():
    ones = [mode(11.0, 0), mode(20.0, 3, share=0.05), mode(37.0, 4)]
    assert match_modes(ones, [mode(11.5, 0)], BAND) == ((0, 0),)


@pytest.mark.parametrize(
    ("ones", "others", "words"),
    [
        ([mode(11.0, 0), mode(20.0, 3)], [mode(11.5, 0)], "20.0 Hz has no partner in the second model"),
        ([mode(11.5, 0)], [mode(11.0, 0), mode(20.0, 3)], "20.0 Hz has no partner in the first model"),
        ([mode(11.0, 0)], [mode(30.0, 0)], "no partner"),
        ([mode(11.0, 0), mode(11.4, 0)], [mode(11.15, 0), mode(11.25, 0)], "in doubt whether the resonances"),
    ],
)
def test_doubt_is_refused(ones, others, words):
    with pytest.raises(ModesDoNotMatchError, match=words):
        match_modes(ones, others, BAND)


def test_a_mode_that_changed_its_shape_altogether_is_refused():
    other = BandMode(11.0, 0.05, np.outer(np.cross(SHAPES[0], SHAPES[1]), SHAPES[0]).astype(complex), 0.5, 1000.0)
    with pytest.raises(ModesDoNotMatchError, match="differ in shape"):
        match_modes([mode(11.0, 0)], [other], BAND)


def test_likeness_ignores_a_complex_factor():
    residue = SHAPES[:3] + 1j * SHAPES[3:]
    assert compute_modal_assurance(residue, (2 - 3j) * residue) == pytest.approx(1)
    assert compute_modal_assurance(np.diag([1, 0, 0]), np.diag([0, 1, 0])) == 0
    assert compute_modal_assurance(np.zeros((3, 3)), residue) == 0
