"""A law without a name in the simulation: where it is a catalogue's law it does what that does.

Differences are relative to what the effect changes.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, cont2discrete, dlsim, sosfilt

from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.discovered_law import (
    Channels,
    get_law_values,
    index_force_signals,
    list_response_signals,
    make_law_effect,
    make_law_parameters,
)
from equalizer.effects.effect import OnCommand, OnResponse, PlacedEffect
from equalizer.effects.simulation.forces_along_motion import compute_effect_forces_along_motion
from equalizer.effects.simulation.mechanism_kernel import MAX_LAWS
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.laws.evaluate import evaluate
from equalizer.laws.law import Law, parse_law
from equalizer.laws.parse import LawError
from equalizer.plant.mechanical_model import MechanicalModel

RATE_HZ, SAMPLES = 1000.0, 3000
COMMANDS = sosfilt(
    butter(2, 40.0, fs=RATE_HZ, output="sos"), np.random.default_rng(16).normal(size=(SAMPLES, 3)), axis=0
)
"""N, slow enough for the motion to be known between samples."""


def at_y(text: str, acts_on: str = "force") -> PlacedEffect:
    law = parse_law(text, acts_on, "y")
    return PlacedEffect(make_law_effect(law), (1,), get_law_values(law))


def apart(bench, effects, others) -> list[float]:
    """Response, and position along the axes where that changes: rms difference over what the others change."""
    plain, one, two = (
        simulate_mechanism(bench.three_axes(), COMMANDS, RATE_HZ, each) for each in ((), effects, others)
    )

    found = []
    for name in ("response", "axis_position"):
        without, law, named = (getattr(played, name) for played in (plain, one, two))
        changed = np.std(named - without)
        found += [float(np.std(law - named) / changed)] if changed > 0 else []
    return found


FORCES = [
    ("-5.0*vy*abs(vy)", "quadratic_damping", {"coefficient": 5.0}, 1e-4),
    ("-1e7*y**3", "hardening_stiffness", {"k3": 1e7}, 1e-5),
    ("0.2*sin(2*pi*y/0.001 + 0.3)", "cogging", {"amplitude": 0.2, "pitch": 0.001, "phase": 0.3}, 1e-3),
    ("-3e4*maximum(y - 0.001, 0)", "end_stop", {"position": 0.001, "stiffness": 3e4}, 1e-3),
    ("-2.0*vy", "viscous_damping", {"damping": 2.0}, 1e-3),
    ("-0.05*ay", "added_mass", {"mass": 0.05}, 1e-2),
    ("0.1*fy", "force_gain", {"gain": 1.1}, 1e-6),
]


@pytest.mark.parametrize(("text", "name", "values", "within"), FORCES, ids=[name for _, name, *_ in FORCES])
def test_a_force_law_is_the_catalogues_law(bench, text, name, values, within):
    other = PlacedEffect(EFFECTS[name], (1,), values)
    assert max(apart(bench, [at_y(text)], [other])) < within


def test_dry_friction_written_as_a_sign_slides_and_sticks(bench):
    """The catalogue's friction bends before it slips, which is a part of the response at each turn."""
    other = PlacedEffect(EFFECTS["coulomb_friction"], (1,), {"level": 0.06})
    response, position = apart(bench, [at_y("-0.06*sign(vy)")], [other])
    assert response < 0.2
    assert position < 0.05
    held = np.zeros((400, 3))
    held[50:, 1] = 0.05
    stuck = simulate_mechanism(bench.three_axes(), held, RATE_HZ, [at_y("-0.06*sign(vy)")])
    assert np.abs(stuck.axis_velocity).max() < 1e-9
    assert stuck.axis_force[200:, 1] == pytest.approx(-0.05, abs=1e-6)


COMMAND_LAWS = [
    ("1.1*fy", "force_gain", {"gain": 1.1}, 1e-9),
    ("minimum(maximum(fy, -0.3), 0.3)", "force_saturation", {"limit": 0.3}, 1e-9),
    ("lag(fy, 0.003)", "amplifier_lag", {"time_constant": 0.003}, 1e-3),
    ("delay(fy, 0.0041)", "transport_delay", {"delay": 0.0041}, 0.02),
]


@pytest.mark.parametrize(("text", "name", "values", "within"), COMMAND_LAWS, ids=[name for _, name, *_ in COMMAND_LAWS])
def test_a_command_law_is_the_catalogues_law(bench, text, name, values, within):
    other = PlacedEffect(EFFECTS[name], (1,), values)
    assert max(apart(bench, [at_y(text, "command")], [other])) < within


def test_a_response_law_is_the_catalogues_law(bench):
    other = PlacedEffect(EFFECTS["sensor_nonlinearity"], (1,), {"cubic": 0.01})
    assert apart(bench, [at_y("ay + 0.01*ay**3", "response")], [other])[0] < 1e-9


def test_a_force_hangs_on_the_motion_of_another_axis(bench):
    """A damping between axes that acts one way only, which a matrix can hold too."""
    model = bench.three_axes()
    damping = model.damping.copy()
    damping[1, 0] += 3.0
    within_model = simulate_mechanism(replace(model, damping=damping), COMMANDS, RATE_HZ)
    plain = simulate_mechanism(model, COMMANDS, RATE_HZ)
    by_law = simulate_mechanism(model, COMMANDS, RATE_HZ, [at_y("-3.0*vx")])
    changed = np.std(within_model.response - plain.response)
    assert np.std(by_law.response - within_model.response) < 1e-3 * changed


def test_a_command_hangs_on_another_channel(bench):
    mixed = COMMANDS.copy()
    mixed[:, 1] += 0.2 * COMMANDS[:, 0]
    by_law = simulate_mechanism(bench.three_axes(), COMMANDS, RATE_HZ, [at_y("fy + 0.2*fx", "command")])
    expected = simulate_mechanism(bench.three_axes(), mixed, RATE_HZ)
    np.testing.assert_allclose(by_law.response, expected.response, rtol=0, atol=1e-12)


def one_body() -> MechanicalModel:
    return MechanicalModel(
        name="one", quantity="acceleration", mass=[[0.2]], damping=[[3.0]], stiffness=[[2000.0]], input=[[1.0]],
        output=[[1.0]],
    )  # fmt: skip


def test_a_relaxing_spring_is_that_of_a_linear_system():
    """Spring and damper in series: F = -k (x - y), y' = (x - y) / tau."""
    law = parse_law("-1500.0*(x - lag(x, 0.02))", "force", "x")
    channels = Channels(("u",), ("a",))
    played = simulate_mechanism(
        one_body(), COMMANDS[:, :1], RATE_HZ, [PlacedEffect(make_law_effect(law, channels), (0,), get_law_values(law))]
    )
    a = np.array([[0.0, 1.0, 0.0], [-(2000.0 + 1500.0) / 0.2, -3.0 / 0.2, 1500.0 / 0.2], [1 / 0.02, 0.0, -1 / 0.02]])
    whole = (a, np.array([[0.0], [1 / 0.2], [0.0]]), np.eye(3)[:1], np.zeros((1, 1)))
    _, expected, _ = dlsim(cont2discrete(whole, 1 / RATE_HZ), COMMANDS[:, :1])
    assert np.std(played.axis_position - expected) < 1e-3 * np.std(expected)


def test_the_force_is_what_the_formula_gives_along_the_motion(bench):
    law = parse_law("-40.0*abs(vy)**1.5*sign(vy) + 200.0*x*vy + 0.1*fx*tanh(y/0.001)", "force", "y")
    effect = PlacedEffect(make_law_effect(law), (1,), get_law_values(law))
    played = simulate_mechanism(bench.three_axes(), COMMANDS, RATE_HZ, [effect])
    columns = {
        **{name: played.axis_position[:, axis] for axis, name in enumerate("xyz")},
        **{f"v{name}": played.axis_velocity[:, axis] for axis, name in enumerate("xyz")},
        # A force is shown as it was just before the next command.
        "fx": np.concatenate([[0.0], COMMANDS[:-1, 0]]),
    }
    expected = evaluate(law, columns, RATE_HZ)
    assert np.std(played.axis_force[:, 1] - expected) < 1e-6 * np.std(expected)
    motion = played.axis_position, played.axis_velocity, np.gradient(played.axis_velocity, 1 / RATE_HZ, axis=0)
    along = compute_effect_forces_along_motion(
        bench.three_axes(), [effect], motion, (COMMANDS, played.axis_force), RATE_HZ
    )
    step_ahead = evaluate(law, {**columns, "fx": COMMANDS[:, 0]}, RATE_HZ)
    assert np.std(along[:-1, 1] - (step_ahead[:-1] + expected[1:]) / 2) < 0.05 * np.std(expected)


def test_laws_act_beside_each_other_and_beside_named_effects(bench):
    drag = PlacedEffect(EFFECTS["quadratic_damping"], (0,), {"coefficient": 5.0})
    spring = PlacedEffect(EFFECTS["hardening_stiffness"], (1,), {"k3": 1e7})
    many = [at_y("-1e6*y**3")] * 10
    assert len(many) > MAX_LAWS
    assert max(apart(bench, [drag, *many], [drag, spring])) < 1e-4


def test_commands_may_be_read_only(bench):
    held = COMMANDS[:50].copy()
    held.flags.writeable = False
    simulate_mechanism(bench.three_axes(), held, RATE_HZ, [at_y("-2.0*vy")])
    along = compute_effect_forces_along_motion(
        bench.three_axes(), [at_y("-2.0*vy")], (COMMANDS[:50],) * 3, (held, held), RATE_HZ
    )
    assert along[:-1, 1] == pytest.approx(-(held[:-1, 1] + held[1:, 1]), rel=0.05)


def test_a_law_of_nothing_changes_nothing(bench):
    plain = simulate_mechanism(bench.three_axes(), COMMANDS, RATE_HZ)
    none = simulate_mechanism(bench.three_axes(), COMMANDS, RATE_HZ, [at_y("0.0*vx*fy")])
    np.testing.assert_allclose(none.response, plain.response, rtol=0, atol=1e-9)


def test_signals_are_called_by_axis_or_as_the_recording_calls_them():
    channels = Channels(("motor",), ("encoder",), "position")
    for text in ("-3.0*vx + 2.0*motor", "-3.0*vx + 2.0*fx", "-1.0*encoder"):
        make_law_effect(parse_law(text, "force", "motor"), channels)
    with pytest.raises(LawError, match="needs the signal 'vy'; there are t, x, vx, ax, fx, encoder, motor"):
        make_law_effect(parse_law("-3.0*vy", "force", "motor"), channels)
    with pytest.raises(LawError, match="needs the signal 'vx'; there are fx, motor, t"):
        make_law_effect(parse_law("fx - 3.0*vx", "command", "motor"), channels)


def test_a_law_for_other_axes_than_the_model_has_is_refused():
    law = parse_law("-3.0*vx", "force", "x")
    with pytest.raises(ValueError, match="is for 3 axes; the model has 1"):
        simulate_mechanism(
            one_body(), np.zeros((9, 1)), RATE_HZ, [PlacedEffect(make_law_effect(law), (0,), get_law_values(law))]
        )


def test_a_fit_may_move_each_number_as_its_role_allows():
    law = Law(
        "-p0*abs(vy)**p1*sign(vy) + p2*sin(y/p3 + p4) - p5*lag(maximum(x - p6, 0), p7)",
        (4.1, 1.5, 0.2, 0.01, 0.3, 2.0, -0.1, 0.02), (), "force", "y",
    )  # fmt: skip
    parameters = make_law_parameters(law)
    scales = [parameter.scale for parameter in parameters]
    assert scales == ["signed", "log", "signed", "log", "linear", "signed", "signed", "log"]
    assert [parameter.none for parameter in parameters] == [0.0, None, 0.0, None, None, 0.0, None, None]


def test_a_channel_named_as_another_signal_does_not_replace_that_signal():
    """Channels of command and response that are called x, y, as the positions in a formula are."""
    channels = Channels(("x", "y"), ("x", "y"))
    assert index_force_signals(channels)["x"] == index_force_signals(Channels(("fx", "fy"), ("ax", "ay")))["x"]
    swapped = index_force_signals(Channels(("fx", "fy"), ("ay", "ax")))
    assert swapped["ax"] == index_force_signals(Channels(("fx", "fy"), ("ax", "ay")))["ax"]
    assert index_force_signals(Channels(("t",), ("a",)))["t"] == 0
    law = parse_law("2.0*fx", "command", "u")
    action = make_law_effect(law, Channels(("u", "fx"), ("a", "b"))).action
    assert isinstance(action, OnCommand)
    assert action.of_all is not None
    commands = np.array([[1.0, 5.0], [1.0, 5.0]])
    assert action.of_all(commands, 0, 1e-3, get_law_values(law))[0] == pytest.approx([2.0, 2.0])


def test_a_law_of_the_response_reads_the_channel_that_it_names():
    """In a file, `x` is the reading of a second channel called x, not that of the first axis."""
    channels = Channels(("m1", "m2"), ("theta", "x"), "position")
    assert list_response_signals(channels) == ("theta", "x")
    law = parse_law("x + 0.5*x**3", "response", "x")
    action = make_law_effect(law, channels).action
    assert isinstance(action, OnResponse)
    readings = np.array([[1.0, 2.0], [1.0, 4.0]])
    assert action.change(readings, 100.0, (1,), get_law_values(law)) == pytest.approx(np.array([[1, 6.0], [1, 36.0]]))
