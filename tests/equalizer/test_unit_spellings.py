"""Spellings of units in files of others: known ones are understood, unknown ones keep their name."""

import pytest

from equalizer.signals.units import (
    KNOWN_UNITS,
    UnknownUnitError,
    check_quantity,
    normalise_unit,
    parse_unit,
    suggest_unit,
)


@pytest.mark.parametrize(
    ("spelled", "unit"),
    [
        ("gf", "gf"), ("RPM", "rpm"), ("Rpm", "rpm"), ("U/min", "rpm"), ("r/min", "rpm"), ("dps", "deg/s"),
        ("deg/s", "deg/s"), ("°/s", "deg/s"), ("º/s", "deg/s"), ("°/s²", "deg/s^2"), ("degrees/second", "deg/s"),
        ("rad/sec", "rad/s"), ("rad/sec2", "rad/s^2"), ("rad/sec^2", "rad/s^2"), ("m/sec2", "m/s^2"),
        ("m/s²", "m/s^2"), ("m/s2", "m/s^2"), ("m/s**2", "m/s^2"), ("m·s⁻²", "m s^-2"), ("m / s", "m/s"),
        ("m.s-2", "m s^-2"), ("μm", "um"), ("µm", "um"), ("micron", "um"), ("inch", "in"), ("kgf·cm", "kgf cm"),
        ("kgf.cm", "kgf cm"), ("kgf-cm", "kgf cm"), ("kg-cm", "kgf cm"), ("oz-in", "ozf in"), ("ozf-in", "ozf in"),
        ("lbf-in", "lbf in"), ("lb-ft", "lbf ft"), ("ft-lb", "lbf ft"), ("N·m", "N m"), ("N⋅m", "N m"),
        ("N-m", "N m"), ("N.m", "N m"), ("Newtons", "N"), ("lbs", "lb"), ("msec", "ms"), ("Sec", "s"),
        ("Volts", "V"), ("amps", "A"), ("A (peak)", "A"), ("Arms", "A"), ("° C", "deg C"), ("°C", "degC"),
        ("ms-1", "m/s"), ("ms-2", "m/s^2"), ("ms^-1", "m/s"), ("ms^-2", "m/s^2"), ("rads-1", "rad/s"),
        ("rads-2", "rad/s^2"), ("ftlbs", "lbf ft"), ("kg f", "kgf"),
        ("㎜", "mm"), ("Upm", "rpm"), ("mm/sek", "mm/s"), ("㎏", "kg"), ("%", "%"),
    ],
)  # fmt: skip
def test_a_spelling_of_others_is_understood(spelled, unit):
    expected = {"deg C": "degC"}.get(unit, unit)
    assert normalise_unit(spelled) == expected
    assert parse_unit(normalise_unit(spelled)) == parse_unit(expected)


@pytest.mark.parametrize("unit", [*KNOWN_UNITS, "N m", "m/s^2", "mN", "MN", "mS", "kg m^2", "oz in^2"])
def test_what_is_written_here_stays(unit):
    assert normalise_unit(unit) == unit


@pytest.mark.parametrize(
    ("unknown", "near"),
    [
        ("MM", "mm"), ("Mpa", "MPa"), ("newt", "N"), ("pound", "lbf"), ("grams", "gf"), ("mm/secnd", "mm/s"),
        ("m/s-2", "m/s^2"), ("rad/s-1", "rad/s"), ("cm/min-1", "cm/min"), ("N/mm-1", "N/mm"), ("NM", "N m"),
        ("inHg", ""), ("H", ""), ("in.Hg", ""), ("kg F", ""), ("C", "degC"),
        ("furlong", ""), ("a.u.", ""), ("V/N/furlong", ""),
    ],
)  # fmt: skip
def test_an_unknown_unit_is_refused_with_the_nearest_known(unknown, near):
    assert normalise_unit(unknown) == unknown
    assert suggest_unit(unknown) == near
    with pytest.raises(UnknownUnitError) as refused:
        parse_unit(unknown)
    assert f"'{unknown}' is not a unit known here" in str(refused.value)
    assert (f"(did you mean '{near}'?)" in str(refused.value)) == bool(near)


def test_a_gram_force_is_a_thousandth_of_a_kilopond():
    assert parse_unit("gf").factor == pytest.approx(parse_unit("kgf").factor / 1000)
    assert parse_unit(normalise_unit("kgf·cm")).factor == pytest.approx(9.80665 / 100)
    assert parse_unit(normalise_unit("oz-in")).factor == pytest.approx(0.0070615518142260)


@pytest.mark.parametrize("unit", ["ms^-1", "ms^-2", "m/s^-2", "N m/rad^-1"])
def test_an_exponent_that_says_the_contrary_of_what_is_meant_is_refused(unit):
    with pytest.raises(UnknownUnitError, match="is not a unit known here"):
        parse_unit(unit)


@pytest.mark.parametrize(
    ("quantity", "unit", "hint"),
    [
        ("force", "g", "grams as a force are written gf"), ("force", "lb", "as a force write lbf"),
        ("torque", "oz in", "as a torque write ozf in, lbf ft"), ("force", "m/s^2", ""), ("force", "V", ""),
    ],
)  # fmt: skip
def test_a_mass_is_no_force_and_the_unit_of_force_is_said(quantity, unit, hint):
    with pytest.raises(UnknownUnitError) as refused:
        check_quantity(quantity, parse_unit(unit))
    assert ("write" in str(refused.value) or "written" in str(refused.value)) == bool(hint)
    assert hint in str(refused.value)
