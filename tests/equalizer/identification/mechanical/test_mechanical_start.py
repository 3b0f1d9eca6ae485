"""Starting values of a mechanical fit are those of the plant where its response is known without noise."""

import numpy as np
import pytest

from equalizer.identification.mechanical.mechanical_lines import SegmentLines
from equalizer.identification.mechanical.mechanical_response import compute_sampled_response
from equalizer.identification.mechanical.mechanical_start import estimate_rigid_starts
from equalizer.identification.mechanical.mechanical_structure import Structure
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Hold


def test_a_further_sensor_is_not_reversed_with_the_sensor_of_the_axis():
    output = np.array([[-1.0], [2.0]])
    plant = MechanicalModel("plant", "acceleration", 0.3 * np.eye(1), np.eye(1), 90 * np.eye(1), np.eye(1), output)
    lines_hz, command = np.arange(1.0, 40.0), np.ones((39, 1), dtype=np.complex128)
    response = compute_sampled_response(plant, lines_hz, 500.0, Hold.ZERO_ORDER)[:, :, 0]
    segment = SegmentLines(
        lines_hz, command, response, np.full((39, 2), np.nan), np.ones(39, dtype=bool), False, 500.0, Hold.ZERO_ORDER
    )
    rigid = Structure(1, 2, "acceleration", 1.0, 100.0, (1.0,))
    (_, (structure, unknowns)) = estimate_rigid_starts([segment], rigid, 0.02)
    assert structure.signs == (-1.0,)
    model = structure.build_model(unknowns)
    assert model.mass[0, 0] == pytest.approx(0.3, rel=0.05)
    np.testing.assert_allclose(model.output, output, rtol=1e-6)
