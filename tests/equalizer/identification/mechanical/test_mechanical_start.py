"""Starting values of a mechanical fit are those of the plant where its response is known without noise."""

import numpy as np
import pytest
from scipy.signal import cont2discrete, dlsim

from equalizer.identification.mechanical.mechanical_fit import fit_mechanical_model
from equalizer.identification.mechanical.mechanical_lines import SegmentLines
from equalizer.identification.mechanical.mechanical_response import compute_sampled_response
from equalizer.identification.mechanical.mechanical_start import estimate_rigid_starts
from equalizer.identification.mechanical.mechanical_structure import Structure
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Hold, Recording
from equalizer.signals.signal import Signal


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


RATE_HZ, MASS_KG, DAMPING, STIFFNESS = 1000.0, 0.25, 1.2, 900.0


@pytest.mark.parametrize("seed", [11, 12])
def test_lines_without_a_command_of_their_own_do_not_outweigh_all_others(seed):
    """Of a recording that is no single period: three levels of a multisine, one after another. Simulated by SciPy."""
    random = np.random.default_rng(seed)
    lines = np.arange(3, 160, 2)  # odd lines of a period of 2 s, to 80 Hz
    phases = 2 * np.pi * np.outer(np.arange(2000) / RATE_HZ, lines / 2) + random.uniform(0, 2 * np.pi, len(lines))
    period = np.cos(phases).sum(axis=1)
    command = np.concatenate([np.tile(level * period / np.abs(period).max(), 4) for level in (1.0, 2.0, 4.0)])
    a, b = np.array([[0.0, 1.0], [-STIFFNESS / MASS_KG, -DAMPING / MASS_KG]]), np.array([[0.0], [1 / MASS_KG]])
    states = dlsim(cont2discrete((a, b, np.eye(2), np.zeros((2, 1))), 1 / RATE_HZ), command)[1]
    held = np.concatenate([[0.0], command[:-1]])  # an acceleration depends on the command up to the sample
    acceleration = states @ a[1] + held / MASS_KG
    acceleration += 0.01 * acceleration.std() * random.standard_normal(len(command))
    found = fit_mechanical_model(
        Recording(
            "plant",
            Signal(command[:, None], RATE_HZ, "force", "N", ("fx",)),
            Signal(acceleration[:, None], RATE_HZ, "acceleration", "m/s^2", ("ax",)),
        )
    )
    fitted = [float(matrix[0, 0]) for matrix in (found.model.mass, found.model.damping, found.model.stiffness)]
    assert fitted == pytest.approx([MASS_KG, DAMPING, STIFFNESS], rel=0.02)
    assert not any("opposite" in remark for remark in found.remarks)
