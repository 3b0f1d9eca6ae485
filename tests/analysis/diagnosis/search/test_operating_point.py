"""A model that was fitted to what changes is played about the point that the device works at."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.confirm.fitting_measures import CONSTANT_ADDED, choose_fitting_measure, shift_to_operating_point
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

RATE_HZ, STIFFNESS = 200.0, 50.0


def make_model(quantity="position", stiffness=STIFFNESS):
    identity = np.eye(1)
    return MechanicalModel("m", quantity, 0.5 * identity, 4.0 * identity, stiffness * identity, identity, identity)


def record_body(weight=0.0, seed=1):
    """A body on a spring that a constant force pushes, too, from where that keeps it."""
    push = np.convolve(np.random.default_rng(seed).standard_normal(4000), np.hanning(30), "same")
    place, speed, found = weight / STIFFNESS, 0.0, []
    for force in push:
        found.append(place)
        for _ in range(10):
            speed += (force + weight - 4.0 * speed - STIFFNESS * place) / 0.5 / RATE_HZ / 10
            place += speed / RATE_HZ / 10
    noisy = np.array(found) + 1e-4 * np.random.default_rng(seed + 1).standard_normal(len(found))
    return Recording(
        "bench",
        Signal(push[:, None], RATE_HZ, "force", "N", ("fx",)),
        Signal(noisy[:, None], RATE_HZ, "position", "m", ("x",)),
    )


def test_the_constant_that_keeps_the_mean_position_is_found_and_said():
    weighed = record_body(weight=20.0)
    (moved,) = shift_to_operating_point((weighed,), make_model()) or ()
    assert np.allclose(moved.command.samples - weighed.command.samples, 20.0, rtol=0.05)
    look = choose_fitting_measure((weighed,), make_model(), (), "auto", about_mean=True)
    assert CONSTANT_ADDED in look.chosen.remarks


def test_a_device_without_a_constant_and_a_calibrated_model_are_played_from_the_command_as_it_is():
    plain = choose_fitting_measure((record_body(),), make_model(), (), "auto", about_mean=True)
    assert CONSTANT_ADDED not in plain.chosen.remarks
    given = choose_fitting_measure((record_body(weight=20.0),), make_model(), (), "auto")
    assert CONSTANT_ADDED not in given.chosen.remarks


def test_what_no_spring_holds_and_what_is_no_position_has_no_such_point():
    assert shift_to_operating_point((record_body(),), make_model(stiffness=0.0)) is None
    moving = replace(record_body(), response=replace(record_body().response, quantity="velocity", unit="m/s"))
    assert shift_to_operating_point((moving,), make_model("velocity")) is None


def test_a_force_balance_is_taken_about_the_mean_force():
    """Of an imposed motion the offset of the force sensor, say: it is many times what the force changes by."""
    offset = record_body(weight=20.0)
    look = choose_fitting_measure((offset,), make_model(), (), "force", about_mean=True)
    assert CONSTANT_ADDED in look.chosen.remarks
    (left,) = look.chosen.measure.residuals(make_model(), ())
    plain = choose_fitting_measure((offset,), make_model(), (), "force")
    (before,) = plain.chosen.measure.residuals(make_model(), ())
    assert np.abs(np.mean(left * look.chosen.measure.unit)) < 0.01
    assert np.mean(before * plain.chosen.measure.unit) == pytest.approx(-20.0, rel=0.05)
