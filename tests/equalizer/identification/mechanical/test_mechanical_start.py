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


UNITS = {"acceleration": "m/s^2", "velocity": "m/s", "position": "m"}


@pytest.mark.parametrize("seed", [42, 43, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(44, 60))])
def test_lines_without_a_command_of_their_own_do_not_outweigh_all_others(seed):
    """Of a recording that is no single period: three levels of a multisine, one after another. The body on a spring is
    drawn, and simulated by SciPy."""
    random = np.random.default_rng(seed)
    quantity, rate_hz = list(UNITS)[seed % 3], float(random.choice([500.0, 1000.0, 2000.0]))
    mass, natural_rad_s = np.exp(random.uniform(np.log(0.05), 0.0)), 2 * np.pi * random.uniform(3, 15)
    damping, stiffness = 2 * np.exp(random.uniform(-4, -0.7)) * mass * natural_rad_s, mass * natural_rad_s**2
    lines = np.arange(3, 160, 2)  # odd lines of a period of 2 s, to 80 Hz
    time_s = np.arange(2 * rate_hz) / rate_hz
    period = np.cos(np.pi * np.outer(time_s, lines) + random.uniform(0, 2 * np.pi, len(lines))).sum(axis=1)
    command = np.concatenate([np.tile(level * period / np.abs(period).max(), 4) for level in (1.0, 2.0, 4.0)])
    a, b = np.array([[0.0, 1.0], [-stiffness / mass, -damping / mass]]), np.array([[0.0], [1 / mass]])
    states = dlsim(cont2discrete((a, b, np.eye(2), np.zeros((2, 1))), 1 / rate_hz), command)[1]
    held = np.concatenate([[0.0], command[:-1]])  # an acceleration depends on the command up to the sample
    motions = {"position": states[:, 0], "velocity": states[:, 1], "acceleration": states @ a[1] + held / mass}
    readings = motions[quantity] + 0.01 * motions[quantity].std() * random.standard_normal(len(command))
    found = fit_mechanical_model(
        Recording(
            "plant",
            Signal(command[:, None], rate_hz, "force", "N", ("fx",)),
            Signal(readings[:, None], rate_hz, quantity, UNITS[quantity], ("r",)),
        )
    )
    fitted = [matrix.item() for matrix in (found.model.mass, found.model.damping, found.model.stiffness)]
    assert fitted == pytest.approx([mass, damping, stiffness], rel=0.02)
    assert not any("opposite" in remark for remark in found.remarks)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3, 9))
def test_neither_leakage_nor_spikes_of_the_sensor_prevent_a_model(seed):
    """Noise of 2 to 40 Hz without a period leaks to other lines. Spikes: 0.3 % of the samples, tenfold the motion."""
    random, rate_hz, samples = np.random.default_rng(seed), 1000.0, 30000
    spectrum, lines_hz = np.fft.rfft(random.standard_normal(samples)), np.fft.rfftfreq(samples, 1 / rate_hz)
    command = np.fft.irfft(np.where((lines_hz > 2) & (lines_hz < 40), spectrum, 0.0), samples)
    command /= command.std()
    a, b = np.array([[0.0, 1.0], [-3600.0, -4.8]]), np.array([[0.0], [4.0]])
    speed = dlsim(cont2discrete((a, b, np.array([[0.0, 1.0]]), np.zeros((1, 1))), 1 / rate_hz), command)[1][:, 0]
    is_spike = random.random(samples) < 0.003
    readings = speed + speed.std() * (0.01 + 10 * is_spike) * random.standard_normal(samples)
    found = fit_mechanical_model(
        Recording(
            "plant",
            Signal(command[:, None], rate_hz, "force", "N", ("fx",)),
            Signal(readings[:, None], rate_hz, "velocity", "m/s", ("r",)),
        )
    )
    fitted = [matrix.item() for matrix in (found.model.mass, found.model.damping, found.model.stiffness)]
    assert fitted == pytest.approx([0.25, 1.2, 900.0], rel=0.01)
    assert "Isolated samples" in found.remarks[-1]
