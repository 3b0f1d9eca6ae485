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
