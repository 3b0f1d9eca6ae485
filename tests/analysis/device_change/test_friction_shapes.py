"""The spectrum of dry friction along a probe's motion agrees with the friction that a device had."""

import numpy as np
import pytest

from analysis.device_change import probe_lines as spectra
from analysis.device_change.probe_lines import compute_friction_spectra, compute_probe_lines
from protocols.definition.probes import ProbeSettings
from study.session.stimulus.probe_stimulus import make_probe_wave

LEVEL_N, RATE_HZ = 0.8, 1000.0
WAVE = make_probe_wave(ProbeSettings(levels_n=(LEVEL_N,)), RATE_HZ)


@pytest.fixture
def bare_device(drifting_device, monkeypatch):
    """A mass on a spring, with friction: without damper, modes, noise and rounding, and with its break-away length
    among those that are tried."""
    exact = {"ROUNDING_M": 1e-10, "NOISE_MPS2": (0.0, 0.0, 0.0), "DAMPING": 0.0, "SPRING_N_PER_M": 0.0, "MODES": ()}
    for name, value in exact.items():
        monkeypatch.setattr(drifting_device, name, value)
    monkeypatch.setattr(spectra, "BREAK_AWAY_LENGTHS_M", (drifting_device.BRISTLE_M,))
    return drifting_device


def test_what_mass_and_spring_leave_of_the_command_is_the_friction(bare_device):
    truth = bare_device.make_truth(hand_kg=0.0, hand_n_s_per_m=2.0, hand_n_per_m=110.0)
    (played,) = bare_device.play(WAVE, [truth], (LEVEL_N,), seed=1)
    lines = compute_probe_lines(played, 1.0)
    friction = truth.friction_n * compute_friction_spectra((lines,), int(RATE_HZ))[0, 0]
    s = 2j * np.pi * lines.frequency_hz[:, None]
    held = truth.hand_n_per_m + truth.hand_n_s_per_m * s
    # A command acts over a step, and the acceleration is read at its end.
    a_step_later = np.exp(s / RATE_HZ)
    left = lines.force_n - (bare_device.MASS_KG * lines.acceleration_mps2 + held * lines.position_m) * a_step_later
    low = lines.driven & (lines.frequency_hz[:, None] < 100)
    assert np.linalg.norm((left - friction)[low]) < 0.02 * np.linalg.norm(friction[low])
