"""An axis whose command is counted against its motion: what is added, or taken off, is the same force on the device."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.effects.command_sign import reverse_commands
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from equalizer.tracking.compensation.effect_compensation import compensate
from equalizer.tracking.compensation.subtract_effects import subtract_effects
from equalizer.tracking.feedforward.band_pass import filter_to_band

RATE_HZ, BAND_HZ = 1000.0, (5.0, 35.0)
FORCES, ACCELERATIONS = ("fx", "fy", "fz"), ("ax", "ay", "az")
WAY = np.array([1.0, -1.0, 1.0])
EFFECTS = (
    ModelEffect("coulomb_friction", None, {"level": 0.1}),
    ModelEffect("asymmetric_friction", "y", {"level_positive": 0.05, "level_negative": 0.2}),
    ModelEffect("asymmetric_stiffness", "y", {"k2": 3e3}),
    ModelEffect("force_deadband", "y", {"width": 0.05}),
)


def physics(turned: bool) -> MechanicalModel:
    eye = np.eye(3)
    model = MechanicalModel("device", "acceleration", 0.28 * eye, eye, eye, eye, eye, effects=EFFECTS)
    return reverse_commands(model, WAY, FORCES, ACCELERATIONS) if turned else model


def shaken(seed: int) -> np.ndarray:
    noise = filter_to_band(np.random.default_rng(seed).standard_normal((3000, 3)), RATE_HZ, BAND_HZ)
    return noise * np.hanning(3000)[:, None] / noise.std()


@pytest.mark.parametrize("amplitude", [None, 1.0])
def test_what_is_added_turns_with_the_command(plants, amplitude):
    plant = plants.omega_like()
    model = IdentifiedModel(
        plant.A, plant.B, plant.C, np.zeros((3, 3)), RATE_HZ, BAND_HZ, "N", "m/s^2", FORCES, ACCELERATIONS
    )
    forces, wanted = shaken(1), shaken(2)
    before = compensate(forces, wanted, model, physics(turned=False), amplitude)
    other = replace(model, B=model.B * WAY)
    after = compensate(forces * WAY, wanted, other, physics(turned=True), amplitude)

    assert np.std(before.forces - forces, axis=0).min() > 0.01
    np.testing.assert_allclose(after.forces, before.forces * WAY, atol=1e-9)


def test_what_is_taken_off_turns_with_the_command():
    def freed(way, turned):
        recording = Recording(
            "rubbing",
            Signal(shaken(3) * way, RATE_HZ, "force", "N", FORCES),
            Signal(shaken(4), RATE_HZ, "acceleration", "m/s^2", ACCELERATIONS),
        )
        return subtract_effects(recording, physics(turned), BAND_HZ).command.samples

    np.testing.assert_allclose(freed(WAY, True), freed(np.ones(3), False) * WAY, atol=1e-9)


def test_an_offset_of_the_sensor_such_as_gravity_changes_nothing():
    def freed(offset):
        recording = Recording(
            "rubbing",
            Signal(shaken(3), RATE_HZ, "force", "N", FORCES),
            Signal(shaken(4) + offset, RATE_HZ, "acceleration", "m/s^2", ACCELERATIONS),
        )
        return subtract_effects(recording, physics(False), BAND_HZ).command.samples

    np.testing.assert_allclose(freed(np.array([0.0, 0.1, 9.81])), freed(0.0), atol=1e-9)
