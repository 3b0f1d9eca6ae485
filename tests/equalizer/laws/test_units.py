"""Units of a law's numbers follow from its formula."""

import pytest

from equalizer.effects.discovered_law import Channels, derive_law_units
from equalizer.laws.law import Law, parse_law
from equalizer.signals.unit_system import LINEAR, ROTATIONAL


@pytest.mark.parametrize(
    ("text", "units"),
    [
        ("-4.1*abs(vy)**1.5*sign(vy)", ("N s^1.5/m^1.5", "1")),
        ("0.2*sin(2*pi*x/0.01 + 0.3)", ("N", "m", "1")),
        ("-3.0*x**2*vx", ("N s/m^3",)),
        ("-1500.0*(x - lag(x, 0.02))", ("N/m", "s")),
        ("-20.0*play(x, 1e-4) + 3.0*integral(x)", ("N/m", "m", "N/(m s)")),
        ("-2.0*maximum(x - 0.01, 0) - 0.1*ax", ("N/m", "m", "N s^2/m")),
        ("0.1*fx*(1 + 0.2*tanh(vy/0.05))", ("1", "1", "m/s")),
        ("0.3/(x + 0.02)", ("N m", "m")),
        ("0.3*0.2*x", ("?", "?")),
        ("0.01*maximum(x - 0.02, 0)**1.5", ("N/m^1.5", "m", "1")),
    ],
)
def test_units_of_a_force(text: str, units: tuple[str, ...]):
    assert derive_law_units(parse_law(text, "force", "y"), Channels(), LINEAR) == units


def test_units_of_a_torque_and_of_a_response():
    assert derive_law_units(
        parse_law("-4.1*vx*abs(vx)", "force", "x"), Channels(("u",), ("q",), "angle"), ROTATIONAL
    ) == ("N m s^2/rad^2",)
    assert derive_law_units(parse_law("ax + 0.2*ax**3", "response", "x"), Channels(), LINEAR) == ("s^4/m^2",)


def test_a_sum_with_a_signal_tells_units_where_its_factor_is_part_of_the_form():
    threshold = Law("0.93*sign(fx)*maximum(abs(fx) - p0, 0)**p1", (0.1, 0.4), (), "command", "x")
    assert derive_law_units(threshold, Channels(), LINEAR) == ("N", "1")
