"""Starting values of a kept law: the factors of a known missing force, by every name that a formula has for signals."""

import numpy as np
import pytest

from equalizer.effects.discovered_law import Channels
from equalizer.effects.law_entry import LawEntry, make_effects_per_axis, make_library_effects
from equalizer.effects.starts.evidence import Evidence
from equalizer.laws.law import parse_law
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

N, RATE_HZ = 4000, 1000.0


@pytest.fixture
def motion():
    """(N, 2): position, velocity and command of the axes x and z."""
    random = np.random.default_rng(8)
    time_s = np.arange(N)[:, None] / RATE_HZ
    phase = 2 * np.pi * np.array([7.0, 11.0]) * time_s
    return np.sin(phase), 2 * np.pi * np.array([7.0, 11.0]) * np.cos(phase), random.standard_normal((N, 2))


def find_starting_values(expression, axis, missing_force, motion):
    position, velocity, command = motion
    identity = np.eye(2)
    model = MechanicalModel(
        name="m", quantity="acceleration", mass=identity, damping=identity, stiffness=identity, input=identity,
        output=identity,
    )  # fmt: skip
    recording = Recording(
        "two axes", Signal(command, RATE_HZ, "force", "N", ("fx", "fz")),
        Signal(np.gradient(velocity, axis=0) * RATE_HZ, RATE_HZ, "acceleration", "m/s^2", ("ax", "az")),
        condition=Signal(np.ones((N, 1)), RATE_HZ, "temperature", "K", ("warmth",)),
    )  # fmt: skip
    zero = np.zeros((N, 2))
    evidence = Evidence(
        model, RATE_HZ, command, position, velocity, missing_force, zero, zero, np.ones(2), np.ones(N)
    )  # fmt: skip
    entry = LawEntry("own_law", parse_law(expression, "force", axis), "found", "varies")
    effects = make_library_effects((entry,), recording)
    return [effect.starts(evidence, site) for site, effect in enumerate(effects)]


@pytest.mark.parametrize(
    ("expression", "regressor"),
    [
        ("-2.0*vz**3", lambda position, velocity, command: velocity**3),
        ("0.5*fz**2", lambda position, velocity, command: command**2),
        ("0.5*z**2", lambda position, velocity, command: position**2),
    ],
)
def test_the_factor_is_regressed_at_every_axis_of_a_device_without_y(motion, expression, regressor):
    """A law of the axis z, at the second of two axes, and moved to x."""
    strengths = np.array([-0.7, 1.3])
    starts = find_starting_values(expression, "z", strengths * regressor(*motion), motion)
    sign = -1.0 if expression.startswith("-") else 1.0
    for (values,), strength in zip(starts, strengths, strict=True):
        assert sign * values["p0"] == pytest.approx(strength, rel=1e-6)


def test_a_law_of_a_recorded_condition_starts_from_the_numbers_of_the_library(motion):
    ((values,), (moved,)) = find_starting_values("-2.0*vx*warmth", "x", 0 * motion[0], motion)
    assert values == moved == {"p0": 2.0}


@pytest.mark.parametrize(("axis", "channels"), [("m2", ("m1", "m2")), ("x", ("a", "x")), ("m2", ("fx", "fy"))])
def test_a_law_moves_with_its_axis_where_channels_are_not_named_by_letters(axis, channels):
    """Signals of a second axis are y and vy in a formula, also where its channel has another name."""
    entry = LawEntry("drag", parse_law("-8.0*vy**3", "force", axis), "found", "varies")
    effects = make_effects_per_axis(entry, Channels(channels, ("s1", "s2")))
    assert [effect.law.text for effect in effects] == ["-8.0*vx**3", "-8.0*vy**3"]


def test_the_letter_of_a_law_is_not_taken_for_a_channel_of_another_axis():
    """A law of another device's axis x, in a device whose second axis (y in a formula) has a channel called x."""
    entry = LawEntry("drag", parse_law("-8.0*vx**3", "force", "x"), "found", "varies")
    effects = make_effects_per_axis(entry, Channels(("theta", "x"), ("s1", "s2")))
    assert [effect.law.text for effect in effects] == ["-8.0*vx**3", "-8.0*vy**3"]
