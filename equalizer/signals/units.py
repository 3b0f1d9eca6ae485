"""Parse ASCII units and convert them to SI: `N`, `m/s^2`, `N m`, `mm/s`, `deg`, `in`, `g` (standard gravity).

A unit is a product of symbols with exponents; each symbol after a slash divides. Factors are exact by definition: inch,
pound, standard gravity (9.80665 m/s^2), and angles as multiples of pi (BIPM, SI Brochure; NIST SP 811).
"""

import math
import re
from dataclasses import dataclass

Dimension = tuple[int, ...]
"""Exponents of kg, m, s, A, K, rad, in this order. The angle is a separate dimension: else N m and N m/rad would be
equal."""


class UnknownUnitError(ValueError):
    """Error for a unit that cannot be parsed, or that does not fit its quantity."""


class _NotAUnitError(UnknownUnitError):
    """Error for a text that is not a unit. Arguments: the text, and the reason as a clause in parentheses or "". The
    message suggests a similar unit; as that search is slow, it is made only when the message is displayed."""

    def __str__(self) -> str:
        text, reason = self.args
        suggestion = suggest_unit(text)
        return (
            f"'{text}' is not a unit known here{reason}"
            + (f" (did you mean '{suggestion}'?)" if suggestion else "")
            + f"; {UNITS_CLAUSE}"
        )


@dataclass(frozen=True, slots=True)
class Unit:
    """Conversion of a unit to SI: value in `si` = value in this unit * factor + offset."""

    si: str
    """Name of the SI unit."""
    factor: float
    dimension: Dimension
    offset: float = 0.0
    """Not zero only for a temperature in `degC` or `degF` by itself: in a product these are temperature differences."""


# Decimal prefixes, and the symbols that take them. Other symbols take none, except in listed units such as `mbar`: `kg`
# is a mass, not a multiple of gravity.
_PREFIX_FACTORS = {"n": 1e-9, "u": 1e-6, "m": 1e-3, "c": 1e-2, "k": 1e3, "M": 1e6}
_PREFIXABLE_DIMENSIONS: dict[str, Dimension] = {
    "N": (1, 1, -2, 0, 0, 0),
    "m": (0, 1, 0, 0, 0, 0),
    "s": (0, 0, 1, 0, 0, 0),
    "rad": (0, 0, 0, 0, 0, 1),
    "V": (1, 2, -3, -1, 0, 0),
    "A": (0, 0, 0, 1, 0, 0),
    "Hz": (0, 0, -1, 0, 0, 0),
    "Pa": (1, -1, -2, 0, 0, 0),
    "J": (1, 2, -2, 0, 0, 0),
    "W": (1, 2, -3, 0, 0, 0),
    "K": (0, 0, 0, 0, 1, 0),
    "ohm": (1, 2, -3, -2, 0, 0),
    "T": (1, 0, -2, -1, 0, 0),
}
_FORCE_DIMENSION, _LENGTH_DIMENSION = _PREFIXABLE_DIMENSIONS["N"], _PREFIXABLE_DIMENSIONS["m"]
_TORQUE_DIMENSION: Dimension = (1, 2, -2, 0, 0, 0)
_POUND_KG, _INCH_M = 0.45359237, 0.0254
"""Kilograms in an avoirdupois pound, metres in an inch (exact by definition)."""
_POUND_FORCE_N = _POUND_KG * 9.80665
"""Newtons in a pound-force: a pound at standard gravity, 9.80665 m/s^2 (exact by definition)."""
_UNPREFIXED_UNITS: dict[str, Unit] = {
    "1": Unit("1", 1.0, (0, 0, 0, 0, 0, 0)),
    "%": Unit("1", 1e-2, (0, 0, 0, 0, 0, 0)),
    "kg": Unit("kg", 1.0, (1, 0, 0, 0, 0, 0)),
    "min": Unit("s", 60.0, (0, 0, 1, 0, 0, 0)),
    "h": Unit("s", 3600.0, (0, 0, 1, 0, 0, 0)),
    "deg": Unit("rad", math.pi / 180, (0, 0, 0, 0, 0, 1)),
    "mdeg": Unit("rad", math.pi / 180e3, (0, 0, 0, 0, 0, 1)),
    "arcmin": Unit("rad", math.pi / 10800, (0, 0, 0, 0, 0, 1)),
    "arcsec": Unit("rad", math.pi / 648000, (0, 0, 0, 0, 0, 1)),
    "rev": Unit("rad", 2 * math.pi, (0, 0, 0, 0, 0, 1)),
    "turn": Unit("rad", 2 * math.pi, (0, 0, 0, 0, 0, 1)),
    "rpm": Unit("rad/s", 2 * math.pi / 60, (0, 0, -1, 0, 0, 1)),
    "g": Unit("m/s^2", 9.80665, (0, 1, -2, 0, 0, 0)),
    "in": Unit("m", _INCH_M, _LENGTH_DIMENSION),
    "ft": Unit("m", 12 * _INCH_M, _LENGTH_DIMENSION),
    "lb": Unit("kg", _POUND_KG, (1, 0, 0, 0, 0, 0)),
    "oz": Unit("kg", _POUND_KG / 16, (1, 0, 0, 0, 0, 0)),
    "lbf": Unit("N", _POUND_FORCE_N, _FORCE_DIMENSION),
    "ozf": Unit("N", _POUND_FORCE_N / 16, _FORCE_DIMENSION),
    "kgf": Unit("N", 9.80665, _FORCE_DIMENSION),
    "gf": Unit("N", 9.80665e-3, _FORCE_DIMENSION),
    "daN": Unit("N", 10.0, _FORCE_DIMENSION),
    "psi": Unit("Pa", _POUND_FORCE_N / _INCH_M**2, _PREFIXABLE_DIMENSIONS["Pa"]),
    "bar": Unit("Pa", 1e5, _PREFIXABLE_DIMENSIONS["Pa"]),
    "mbar": Unit("Pa", 1e2, _PREFIXABLE_DIMENSIONS["Pa"]),
    "hPa": Unit("Pa", 1e2, _PREFIXABLE_DIMENSIONS["Pa"]),
    "degC": Unit("K", 1.0, _PREFIXABLE_DIMENSIONS["K"], 273.15),
    "degF": Unit("K", 5 / 9, _PREFIXABLE_DIMENSIONS["K"], 459.67 * 5 / 9),
    "Nm": Unit("N m", 1.0, _TORQUE_DIMENSION),
    "kNm": Unit("N m", 1e3, _TORQUE_DIMENSION),
    "mNm": Unit("N m", 1e-3, _TORQUE_DIMENSION),
    "Ncm": Unit("N m", 1e-2, _TORQUE_DIMENSION),
    "Nmm": Unit("N m", 1e-3, _TORQUE_DIMENSION),
    "counts": Unit("1", 1.0, (0,) * 6),
    "count": Unit("1", 1.0, (0,) * 6),
}
KNOWN_UNITS = (
    "deg", "mdeg", "arcmin", "arcsec", "g", "rpm", "rev", "turn", "min", "h", "%", "in", "ft", "lbf", "ozf", "kgf",
    "gf", "daN", "lb", "oz", "psi", "bar", "mbar", "hPa", "degC", "degF", "Nm", "mNm", "Ncm", "Nmm", "kNm", "counts",
)  # fmt: skip
"""Units accepted in addition to SI. `g` is standard gravity, never a gram; `lb` and `oz` are masses, `lbf` and `ozf`
forces; `counts` (`count` is accepted, too) are plain numbers of unknown scale."""

UNITS_CLAUSE = (
    "allowed are SI symbols in ASCII (N, N m, m, rad, m/s, m/s^2, rad/s^2, V, A, kg, s, Hz, 1 ...; "
    f"prefixes n u m c k M) and {', '.join(KNOWN_UNITS)}"
)
"""Clause of error messages that lists the accepted units."""

QUANTITY_UNITS: dict[str, tuple[str, ...]] = {
    "force": ("N", "N m"),
    "torque": ("N m",),
    "position": ("m", "rad"),
    "displacement": ("m", "rad"),
    "angle": ("rad",),
    "velocity": ("m/s", "rad/s"),
    "speed": ("m/s", "rad/s"),
    "acceleration": ("m/s^2", "rad/s^2"),
    "voltage": ("V",),
    "current": ("A",),
    "time": ("s",),
}
"""SI units that a well-known quantity may have. A quantity that is not listed may have any unit."""

NO_UNIT = "1"
"""SI unit of numbers without a unit or of unknown scale (`counts`); they are not converted, except `%`."""

MAX_UNIT_TEXT_LENGTH = 100
"""Largest number of characters of a text for which other spellings are tried. Chosen; bounds the duration of the
search."""

_SYMBOLS = frozenset(_UNPREFIXED_UNITS) | {
    prefix + base for prefix in ("", *_PREFIX_FACTORS) for base in _PREFIXABLE_DIMENSIONS
}


def parse_unit(text: str) -> Unit:
    """Parse a unit: a product such as `N m s/rad`. Raises UnknownUnitError for an empty text and any other that is not
    a unit; its message lists the accepted units."""
    if not text.strip():
        raise UnknownUnitError(f"the unit is missing; {UNITS_CLAUSE}")
    if text.strip() in _UNPREFIXED_UNITS:
        return _UNPREFIXED_UNITS[text.strip()]
    if re.fullmatch(r"ms\^-[12]", text.strip()):  # m/s is meant, but would be read as 1/ms
        raise _NotAUnitError(text, "")
    exponents_by_symbol: dict[str, int] = {}
    factor = 1.0
    dimension: Dimension = (0,) * 6
    factors = [(symbol, power) for symbol, power in _parse_factors(text) if symbol != "1"]
    for symbol, power in factors:
        unit = _parse_symbol(symbol, text)
        factor *= unit.factor**power
        dimension = tuple(
            exponent_sum + power * added_exponent
            for exponent_sum, added_exponent in zip(dimension, unit.dimension, strict=True)
        )
        for base_symbol, exponent in _parse_factors(unit.si):
            exponents_by_symbol[base_symbol] = exponents_by_symbol.get(base_symbol, 0) + power * exponent
    is_energy = dimension == _TORQUE_DIMENSION and not exponents_by_symbol.keys().isdisjoint(("J", "W"))
    si = "J" if is_energy else _PREFERRED_SPELLINGS.get(dimension) or _format_symbols(exponents_by_symbol)
    return Unit(si, factor, dimension, unit.offset if [power for _, power in factors] == [1] else 0.0)


def check_quantity(quantity: str, unit: Unit) -> None:
    """Check that the unit fits the quantity. Raises UnknownUnitError where a quantity of `QUANTITY_UNITS` has a unit
    that is not listed there. The unit 1 (unknown scale) fits every quantity."""
    allowed_units = QUANTITY_UNITS.get(quantity)
    if allowed_units and unit.si not in (*allowed_units, NO_UNIT):
        raise UnknownUnitError(
            f"the quantity '{quantity}' cannot be in {unit.si}; it is in {' or '.join(allowed_units)}"
            f"{suggest_force_unit(quantity, unit)}"
        )


def suggest_force_unit(quantity: str, unit: Unit) -> str:
    """Suggest units for a force or torque that is stated in a unit of mass or in `g`, or a torque in mass times length,
    as a clause that follows the error; empty for other units and quantities."""
    is_gravity = unit.si == "m/s^2" and unit.factor == _UNPREFIXED_UNITS["g"].factor
    if quantity == "force" and (is_gravity or unit.si == "kg"):
        return "; grams as a force are written gf" if is_gravity else "; as a force write lbf, ozf or kgf"
    if quantity == "torque" and (is_gravity or unit.si in ("kg", "kg m")):
        return "; as a torque write ozf in, lbf ft, gf cm or kgf cm"
    return ""


def find_quantity(si: str) -> str:
    """Find the usual quantity of an SI unit, such as "force" for N; the unit itself where there is none."""
    return _USUAL_QUANTITIES.get(si, si)


_USUAL_QUANTITIES = {
    "N": "force", "N m": "torque", "m": "position", "rad": "angle", "m/s": "velocity", "rad/s": "velocity",
    "m/s^2": "acceleration", "rad/s^2": "acceleration", "V": "voltage", "A": "current", "s": "time",
    "K": "temperature", "Pa": "pressure",
}  # fmt: skip


def _parse_factors(text: str) -> list[tuple[str, int]]:
    """Split a unit into its symbols with their exponents; a symbol after a slash has a negative exponent. Raises
    UnknownUnitError."""
    numerator, *denominator_texts = text.replace("*", " ").split("/")
    factors = [_parse_power(factor_text, 1, text) for factor_text in numerator.split()]
    for denominator_text in denominator_texts:
        if len(denominator_text.split()) != 1:
            raise _NotAUnitError(text, " (each slash must be followed by exactly one symbol, as in N m s/rad or m/s/V)")
        if "-" in denominator_text:
            raise _NotAUnitError(text, " (an exponent after a slash must not be negative, as in m/s^2)")
        factors.append(_parse_power(denominator_text.strip(), -1, text))
    if not numerator.strip():
        raise _NotAUnitError(text, "")
    return factors


def _parse_power(factor_text: str, sign: int, unit_text: str) -> tuple[str, int]:
    """Parse a factor such as `s^2` into its symbol and its exponent (-9 to 9, not 0) times sign. unit_text: the whole
    unit, for the error. Raises UnknownUnitError."""
    match = re.fullmatch(r"([A-Za-z%]+|1)(?:\^(-?[1-9]))?", factor_text)
    if not match:
        raise _NotAUnitError(unit_text, "")
    return match[1], sign * int(match[2] or 1)


def _parse_symbol(symbol: str, unit_text: str) -> Unit:
    """Find the unit of a symbol with or without prefix. unit_text: the whole unit, for the error. Raises
    UnknownUnitError."""
    if symbol in _UNPREFIXED_UNITS:
        return _UNPREFIXED_UNITS[symbol]
    if symbol in _PREFIXABLE_DIMENSIONS:
        return Unit(symbol, 1.0, _PREFIXABLE_DIMENSIONS[symbol])
    prefix, base = symbol[0], symbol[1:]
    if prefix in _PREFIX_FACTORS and base in _PREFIXABLE_DIMENSIONS:
        return Unit(base, _PREFIX_FACTORS[prefix], _PREFIXABLE_DIMENSIONS[base])
    raise _NotAUnitError(unit_text, "")


def _format_symbols(exponents_by_symbol: dict[str, int]) -> str:
    """Format a product of symbols with exponents, such as `N m/rad`; `1` for none."""
    numerator = [
        _format_power(symbol, power) for symbol, power in exponents_by_symbol.items() if power > 0 and symbol != "1"
    ]
    denominators = [
        _format_power(symbol, -power) for symbol, power in exponents_by_symbol.items() if power < 0 and symbol != "1"
    ]
    return "/".join([" ".join(numerator) or "1", *denominators])


def _format_power(symbol: str, power: int) -> str:
    """Format a symbol with its exponent, above 0; the exponent 1 is omitted."""
    return symbol if power == 1 else f"{symbol}^{power}"


def suggest_unit(text: str) -> str:
    """Find the accepted unit of the most similar spelling to a text that is not a unit; empty where none is similar,
    and for a text above `MAX_UNIT_TEXT_LENGTH`."""
    respelled_text = normalise_unit(text)
    if respelled_text != text:
        return respelled_text
    from equalizer.signals.unit_spellings import find_nearest_unit

    nearest_unit = find_nearest_unit(text, _SYMBOLS) if len(text) <= MAX_UNIT_TEXT_LENGTH else text
    return nearest_unit if nearest_unit != text and _is_accepted(nearest_unit) else ""


def normalise_unit(text: str) -> str:
    """Rewrite a unit in the spelling of this module (`m/s^2` for `m/s²` and `m/sec2`, `rpm` for `RPM`); text that is
    not a unit, or longer than `MAX_UNIT_TEXT_LENGTH`, is returned unchanged."""
    if len(text) > MAX_UNIT_TEXT_LENGTH:
        return text
    # Imported on demand: a unit in the spelling of this module does not need it.
    from equalizer.signals.unit_spellings import respell

    respelled_text = respell(text, _SYMBOLS)
    return respelled_text if respelled_text != text and _is_accepted(respelled_text) else text


def _is_accepted(text: str) -> bool:
    """Whether `parse_unit` accepts the text."""
    try:
        parse_unit(text)
    except UnknownUnitError:
        return False
    return True


# Preferred spelling of a unit by dimension: kg m/s^2 is written as N, m/s/s as m/s^2. Only the dimension of the parsed
# unit is used here, which does not depend on the entries that `parse_unit` finds in this unfinished table.
_PREFERRED_SPELLINGS: dict[Dimension, str] = {}
for _unit_text in ("N", "N m", "m", "m/s", "m/s^2", "rad", "rad/s", "rad/s^2", "V", "A", "s", "kg", "1"):
    _PREFERRED_SPELLINGS[parse_unit(_unit_text).dimension] = _unit_text
