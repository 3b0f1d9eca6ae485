"""What hangs on an axis, looked for in the spectra of a missing force."""

import numpy as np

from equalizer.effects.starts.attached_oscillator import MissingForceSpectra, find_likely_oscillators


def test_where_no_frequency_is_driven_nothing_hangs():
    nothing = MissingForceSpectra(np.zeros(0), np.zeros(0), np.zeros((0, 1), dtype=complex))
    assert find_likely_oscillators(nothing, 0, [4.0, 11.0], [0.02]) == []
