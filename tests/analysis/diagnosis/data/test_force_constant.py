"""A command in amperes becomes a force or torque where its constant is stated, and only there."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.data.force_constant import ForceConstantError, convert_commands_to_forces
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal


def make_recording(unit: str = "A", moved: str = "rad") -> Recording:
    samples = np.arange(8.0)[:, None]
    return Recording(
        "motor",
        Signal(samples, 500.0, "current" if unit == "A" else "torque", unit, ("i",)),
        Signal(samples, 500.0, "angle" if moved == "rad" else "position", moved, ("q",)),
    )


def test_amperes_become_newton_metres():
    found, said = convert_commands_to_forces(make_recording(), (0.05,))
    assert (found.command.quantity, found.command.unit) == ("torque", "N m")
    assert np.array_equal(found.command.samples[:, 0], 0.05 * np.arange(8.0))
    assert said == "The commands were multiplied by the torque constant that was stated, 0.05 N m per A."


def test_the_part_that_was_decided_goes_with_it():
    given = make_recording()
    found, _ = convert_commands_to_forces(replace(given, excitation=given.command), (0.05,))
    assert np.array_equal(found.excitation.samples, found.command.samples)


@pytest.mark.parametrize(
    ("unit", "moved", "constants", "said"),
    [("N m", "rad", (0.05,), "a force already"), ("A", "1", (0.05,), "give its unit"),
     ("A", "rad", (0.05, 0.04), "for 1 commands"), ("A", "rad", (0.0,), "other than 0")],
)  # fmt: skip
def test_what_makes_no_sense_is_refused(unit, moved, constants, said):
    with pytest.raises(ForceConstantError, match=said):
        convert_commands_to_forces(make_recording(unit, moved), constants)


@pytest.mark.parametrize(("quantity", "unit", "name"), [("voltage", "V", "load cell"), ("1", "1", "load cell")])
def test_of_an_imposed_motion_the_measured_force_is_converted(quantity, unit, name):
    samples = np.arange(8.0)[:, None]
    imposed = Recording(
        "rig", Signal(samples, 500.0, "position", "m", ("x",)), Signal(samples, 500.0, quantity, unit, (name,))
    )
    found, said = convert_commands_to_forces(imposed, (200.0,))
    assert found.command is imposed.command
    assert (found.response.quantity, found.response.unit) == ("force", "N")
    assert np.array_equal(found.response.samples[:, 0], 200 * np.arange(8.0))
    assert said.startswith("The responses were multiplied by the force constant that was stated, 200 N")


def test_a_servo_with_a_target_and_a_position_by_name_has_no_measured_force():
    samples = np.arange(8.0)[:, None]
    servo = Recording(
        "servo", Signal(samples, 500.0, "angle", "rad", ("target",)), Signal(samples, 500.0, "1", "1", ("angle",))
    )
    with pytest.raises(ForceConstantError, match="the motion is in 1: .* give its unit"):
        convert_commands_to_forces(servo, (0.05,))
