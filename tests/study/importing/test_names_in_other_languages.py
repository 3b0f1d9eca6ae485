"""Headers in Spanish, German and French, and names whose unit or words are joined by underscores."""

import tomllib

import numpy as np
import pytest

from study.importing.arrays.read_arrays import Arrays
from study.importing.header_map import find_header_problems, make_header_map
from study.importing.map_format.signal_words import parse_signal_name
from study.importing.map_skeleton import make_map_skeleton
from tests.recording_maps import U, Y, built, map_text, refusal


def arrays(tmp_path, *names):
    columns = {name: np.random.default_rng(k).standard_normal(100) for k, name in enumerate(names)}
    columns[names[0]] = np.arange(100) / 50
    return Arrays(tmp_path / "a.csv", columns)


@pytest.mark.parametrize(
    "names",
    [("Tiempo [s]", "Entrada", "Ángulo [deg]", "Velocidad [rad/s]"), ("Tiempo [s]", "mando", "POSICION", "velocidad"),
     ("Tiempo [s]", "Voltaje [V]", "angulo", "velocidad"), ("Zeit [s]", "Kraft [N]", "Weg [mm]", "Drehzahl [rpm]"),
     ("Zeit [s]", "Eingang", "Winkel", "Geschwindigkeit"), ("Zeit [s]", "Strom [A]", "Lage", "Beschleunigung"),
     ("temps [s]", "entrée", "position [mm]", "vitesse [mm/s]"), ("temps [s]", "courant [A]", "angle", "vitesse"),
     ("time_s", "input", "Speed_rpm"), ("time_s", "torque_Nm", "WSA_rad", "Yaw_Rate")],
)  # fmt: skip
def test_a_header_says_all(tmp_path, names):
    wanted = make_header_map(arrays(tmp_path, *names))
    assert wanted is not None
    assert [channel.value for channel in wanted.channel if channel.role == "command"] == [names[1]]
    assert [channel.value for channel in wanted.channel if channel.role == "response"] == [names[-1]]


@pytest.mark.parametrize(
    ("name", "unit", "quantity"),
    [("WSA_rad", "rad", "angle"), ("Speed_rpm", "rpm", "velocity"), ("Yaw_Rate", "", "velocity"),
     ("Yaw_Rate_deg_s", "deg/s", "velocity"), ("pitch [deg]", "deg", "angle"), ("Fuerza_N", "N", "force")],
)  # fmt: skip
def test_what_underscores_join_is_sure(name, unit, quantity):
    found = parse_signal_name(name)
    assert (found.unit, found.quantity, found.is_certain) == (unit, quantity, True)


@pytest.mark.parametrize("name", ["phase_A", "y_s", "stage_in", "value_min", "average_MA"])
def test_an_end_that_may_be_a_word_stays_unsure(name):
    assert not parse_signal_name(name).is_certain


def test_the_output_of_a_loop_is_proposed_and_what_it_measures_stays_open(tmp_path):
    held = arrays(tmp_path, "Tiempo [s]", "Entrada", "Salida", "referencia")
    roles = [line.split('"')[1] for line in make_map_skeleton(held).splitlines() if line.startswith("role")]
    assert roles == ["command", "response", "helper"]
    assert "nothing says what 'Salida' is" in find_header_problems(held)


def test_an_input_among_other_words_is_no_command(tmp_path):
    wanted = make_header_map(arrays(tmp_path, "time [s]", "torque [Nm]", "input angle [rad]", "output speed [rpm]"))
    assert [channel.role for channel in wanted.channel] == ["command", "position", "response"]


@pytest.mark.parametrize(("header", "expression"), [("x_µm", "2 * x_µm"), ("de\u0301bit", "d\u00e9bit")])
def test_the_same_letters_of_other_code_points_are_the_same_name(files, header, expression):
    text = map_text().replace('value = "y"', f'value = "{expression}"')
    found = built(text, files(**{"u": U, header: Y})).recording
    np.testing.assert_allclose(found.response.samples[:, 0], (2 if "2" in expression else 1) * 9.80665 * Y)


def test_a_digit_is_not_the_exponent_of_the_same_number(files):
    text = map_text().replace('value = "y"', 'value = "x2"')
    assert "there is no array 'x2' in a.npz" in refusal(text, files(**{"u": U, "x²": Y}))


@pytest.mark.parametrize("name", ["𝜔", "Größe", "line\nrole = 'break'", "delete\x7f", 'say "no"', "back\\slash"])
def test_the_proposed_map_is_toml_with_any_name(tmp_path, name):
    values = {
        channel["value"] for channel in tomllib.loads(make_map_skeleton(arrays(tmp_path, "t_s", name)))["channel"]
    }
    assert values == {name}
