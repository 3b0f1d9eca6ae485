import math

import pytest

from equalizer.signals.units import (
    KNOWN_UNITS,
    UNITS_CLAUSE,
    UnknownUnitError,
    check_quantity,
    find_quantity,
    parse_unit,
)


@pytest.mark.parametrize(
    ("text", "si", "factor"),
    [
        ("N", "N", 1.0),
        ("mN", "N", 1e-3),
        ("N m", "N m", 1.0),
        ("N*mm", "N m", 1e-3),
        ("m/s^2", "m/s^2", 1.0),
        ("m s^-2", "m/s^2", 1.0),
        ("m/s/s", "m/s^2", 1.0),
        ("g", "m/s^2", 9.80665),
        ("mm", "m", 1e-3),
        ("um", "m", 1e-6),
        ("mm/s", "m/s", 1e-3),
        ("deg", "rad", math.pi / 180),
        ("deg/s^2", "rad/s^2", math.pi / 180),
        ("rpm", "rad/s", math.pi / 30),
        ("rad/s^2", "rad/s^2", 1.0),
        ("V", "V", 1.0),
        ("kg m/s^2", "N", 1.0),
        ("kg m^2", "kg m^2", 1.0),
        ("N m s/rad", "N m s/rad", 1.0),
        ("N m/rad", "N m/rad", 1.0),
        ("N s^2/m^2", "N s^2/m^2", 1.0),
        ("g/V", "m/s^2/V", 9.80665),
        ("1/m", "1/m", 1.0),
        ("%", "1", 0.01),
        ("in", "m", 0.0254),
        ("ft/s", "m/s", 0.3048),
        ("lbf", "N", 4.4482216152605),
        ("lbf in", "N m", 0.1129848290276167),
        ("ozf in", "N m", 0.0070615518142260),
        ("lb", "kg", 0.45359237),
        ("oz in^2", "kg m^2", 1.8289978339325e-5),
        ("psi", "Pa", 6894.757293168361),
        ("turn", "rad", 2 * math.pi),
        ("rev/s", "rad/s", 2 * math.pi),
        ("kgf", "N", 9.80665),
        ("mNm", "N m", 1e-3),
        ("Nm/rad", "N m/rad", 1.0),
        ("counts", "1", 1.0),
        ("J", "J", 1.0),
        ("mJ", "J", 1e-3),
        ("W s", "J", 1.0),
        ("J/m", "N", 1.0),
        ("N m/turn", "N m/rad", 1 / (2 * math.pi)),
    ],
)
def test_a_known_unit_becomes_si(text, si, factor):
    unit = parse_unit(text)
    assert (unit.si, unit.factor) == (si, pytest.approx(factor, rel=1e-14))


@pytest.mark.parametrize("text", ["N", "m/s^2", "N m s/rad", "N s^2/m^2", "m/s^2/V", "1/m", "kg m^2"])
def test_what_is_si_stays_as_it_is_written(text):
    assert parse_unit(parse_unit(text).si) == parse_unit(text)
    assert parse_unit(text).si == text


def test_g_is_standard_gravity_and_never_a_gram():
    assert parse_unit("g").dimension == parse_unit("m/s^2").dimension
    with pytest.raises(UnknownUnitError, match="'mg' is not a unit known here"):
        parse_unit("mg")


@pytest.mark.parametrize("text", ["furlong", "N//m", "m/s^0", "/s", "m^", "degX", "N\nm^x", "[N]"])
def test_an_unknown_unit_is_refused_by_name_with_what_is_allowed(text):
    with pytest.raises(UnknownUnitError) as refused:
        parse_unit(text)
    assert f"'{text}' is not a unit known here" in str(refused.value)
    assert UNITS_CLAUSE in str(refused.value)
    assert all(known in UNITS_CLAUSE for known in KNOWN_UNITS)


def test_a_missing_unit_is_said_to_be_missing():
    with pytest.raises(UnknownUnitError, match=r"the unit is missing; allowed are SI symbols in ASCII"):
        parse_unit(" ")


def test_a_product_after_a_stroke_is_refused_because_it_can_be_read_two_ways():
    with pytest.raises(UnknownUnitError, match="each slash must be followed by exactly one symbol"):
        parse_unit("N/m s")


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("m/s²", "m/s^2"),
        ("µm", "um"),
        ("°", "deg"),
        ("m/s2", "m/s^2"),
        ("m/s**2", "m/s^2"),
        ("lbf-ft", "lbf ft"),
        ("°C", "degC"),
    ],
)
def test_a_unit_that_is_nearly_right_gets_a_suggestion(text, meant):
    with pytest.raises(UnknownUnitError) as refused:
        parse_unit(text)
    assert f"(did you mean '{meant}'?)" in str(refused.value)


def test_a_quantity_in_the_unit_of_another_is_refused():
    check_quantity("force", parse_unit("mN"))
    check_quantity("brightness", parse_unit("V"))
    with pytest.raises(UnknownUnitError, match="the quantity 'force' cannot be in m; it is in N or N m"):
        check_quantity("force", parse_unit("mm"))


def test_energy_is_no_torque():
    with pytest.raises(UnknownUnitError, match="the quantity 'torque' cannot be in J; it is in N m"):
        check_quantity("torque", parse_unit("kJ"))


def test_a_mass_is_no_force_and_the_force_is_named():
    with pytest.raises(UnknownUnitError, match="cannot be in kg; it is in N or N m; as a force write lbf, ozf or kgf"):
        check_quantity("force", parse_unit("lb"))


def test_a_quantity_of_unknown_scale_may_be_any():
    for quantity in ("position", "force", "acceleration"):
        check_quantity(quantity, parse_unit("1"))


@pytest.mark.parametrize(
    ("text", "value", "kelvin"),
    [
        ("degC", 20.0, 293.15),
        ("1 degC", 20.0, 293.15),
        ("degC^1", 20.0, 293.15),
        ("degF", 68.0, 293.15),
        ("K", 5.0, 5.0),
    ],
)
def test_a_temperature_alone_has_an_offset(text, value, kelvin):
    unit = parse_unit(text)
    assert value * unit.factor + unit.offset == pytest.approx(kelvin)


def test_a_temperature_in_a_product_is_a_difference():
    assert (parse_unit("N/degC").si, parse_unit("N/degC").offset) == ("N/K", 0.0)


def test_the_usual_word_for_a_unit():
    assert [find_quantity(si) for si in ("N", "m/s^2", "rad", "N/V")] == ["force", "acceleration", "angle", "N/V"]
