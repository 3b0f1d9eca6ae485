"""Normalisation of the spelling of units in recordings of other laboratories: `RPM`, `m/sec2`, `°/s`, `kgf·cm`,
`oz-in`.

Symbols are rewritten only where a spelling is listed; signs, powers and products are rewritten in any text (`foo2`
becomes `foo^2`), and `units.normalise_unit` restores a text that is no unit afterwards. The meaning of a unit is not
examined. For an unknown symbol the nearest known one can be suggested.
"""

import re
import unicodedata
from collections.abc import Collection
from difflib import get_close_matches

_ASCII_BY_SIGN = {
    "º": "°", "˚": "°", "μ": "u", "µ": "u", "°": "deg", "Ω": "ohm", "·": " ", "•": " ", "∙": " ", "⋅": " ", "×": " ",
    "*": " ", "−": "-", "–": "-",
}  # fmt: skip
"""Signs, each with its replacement. The table is applied twice: `º` and `˚` become `°`, which becomes `deg`."""
_SPELLINGS = {
    "s": "sec secs sek second seconds",
    "ms": "msec msecs millisec millisecond milliseconds",
    "us": "usec usecs microsec microsecond microseconds",
    "ns": "nsec nanosecond nanoseconds",
    "min": "mins minute minutes",
    "h": "hr hrs hour hours",
    "Hz": "hz hertz",
    "kHz": "khz",
    "deg": "degs degree degrees",
    "rad": "rads radian radians",
    "rev": "revs revolution revolutions rot",
    "turn": "turns",
    "rpm": "revpm upm",
    "m": "meter meters metre metres",
    "cm": "centimeter centimeters centimetre centimetres",
    "mm": "millimeter millimeters millimetre millimetres",
    "um": "micron microns micrometer micrometers micrometre micrometres",
    "in": "inch inches",
    "ft": "foot feet",
    "N": "newton newtons",
    "kN": "kilonewton kilonewtons",
    "lbf": "lbsf",
    "lb": "lbs",
    "kgf": "kp",
    "V": "volt volts",
    "mV": "millivolt millivolts",
    "A": "amp amps ampere amperes",
    "mA": "milliamp milliamps milliampere milliamperes",
    "ohm": "ohms",
    "Pa": "pascal pascals",
    "%": "percent pct",
    "counts": "cts tick ticks pulse pulses lsb",
    "degC": "celsius",
    "degF": "fahrenheit",
}
"""Symbols, each with its other spellings."""
_SYMBOL_BY_SPELLING = {word: unit for unit, words in _SPELLINGS.items() for word in words.split()} | {
    unit.lower(): unit for unit in _SPELLINGS if len(unit) > 2
}
"""Symbol of each other spelling; symbols of more than two letters also in lower case."""
_UNIT_BY_SPELLING = {
    "dps": "deg/s", "mps": "m/s", "mps2": "m/s^2", "r/min": "rpm", "U/min": "rpm", "deg C": "degC", "deg F": "degF",
    "deg. C": "degC", "degree C": "degC", "degrees C": "degC", "% RH": "%", "%RH": "%", "%rh": "%",
    "ozin": "ozf in", "inoz": "ozf in", "lbin": "lbf in", "inlb": "lbf in", "lbft": "lbf ft", "ftlb": "lbf ft",
    "lbfin": "lbf in", "lbfft": "lbf ft", "ozfin": "ozf in", "kgfcm": "kgf cm", "kgcm": "kgf cm", "gfcm": "gf cm",
    "gcm": "gf cm", "N_m": "N m", "kg f": "kgf", "lb f": "lbf", "g f": "gf",
}  # fmt: skip
"""Spellings that are looked up as a whole, because the rules for single symbols do not give their unit."""
_TORQUE_BY_SPELLING = {
    "oz in": "ozf in", "in oz": "ozf in", "lb in": "lbf in", "in lb": "lbf in", "lb ft": "lbf ft", "ft lb": "lbf ft",
    "kg cm": "kgf cm", "g cm": "gf cm",
}  # fmt: skip
"""Torques written with a unit of mass; `oz in^2`, an inertia, is not listed."""
_SUGGESTED_UNIT = {"pound": "lbf", "pounds": "lbf", "gram": "gf", "grams": "gf", "gs": "g", "nm": "N m"}
_SUGGESTED_WHOLE_UNIT = {"c": "degC", "f": "degF", "g": "g"}
"""Suggested unit of a word, and of a word that is the whole unit. They are suggested to the user but not applied:
pounds and grams are masses, too, and a capital is another symbol than a small letter."""
_LEAST_SIMILARITY, _LEAST_SIMILARITY_IN_PRODUCT = 0.8, 0.9
"""Least similarity (0 to 1, `difflib`) of a suggested symbol that is the whole unit, and of one within a product.
Chosen by hand."""
_POWER_OF_SECOND = re.compile(r"(m|mm|cm|um|rad|mrad|deg|rev)s\^-([12])")
"""`ms^-2` means m/s^2 in recordings, not one over milliseconds squared."""
_AMPLITUDE = re.compile(r"(?P<unit>m?[AV])\s*[_ ]?\(?(?:peak|pk|rms)\.?\)?", re.IGNORECASE)
"""Volts and amperes with the way they were measured (`A (peak)`, `V rms`), which is not part of a unit."""


def respell(text: str, known_symbols: Collection[str]) -> str:
    """Rewrite a unit in the spelling of `signals.units`, by the listed spellings and the rules of this module; other
    parts are unchanged. known_symbols: symbols of that spelling, which are changed only as parts of a unit that is
    looked up as a whole."""
    spelling = text.strip()
    if amplitude_match := _AMPLITUDE.fullmatch(spelling):
        return amplitude_match["unit"]
    spelling = _convert_to_ascii(
        unicodedata.normalize("NFKC", _convert_to_ascii(spelling.replace("**", "^").replace("⁻", "-")))
    )
    spelling = re.sub(r"\s*/\s*", "/", spelling.strip().rstrip("."))
    # A power without its sign: m/s2 becomes m/s^2, and s-1 becomes s^-1.
    spelling = re.sub(r"(?<=[A-Za-z])(-[1-9]|[2-9])(?![A-Za-z0-9])", r"^\1", spelling)
    spelling = _POWER_OF_SECOND.sub(
        lambda power_match: f"{power_match[1]}/s" + ("^2" if power_match[2] == "2" else ""), spelling
    )
    spelling = _UNIT_BY_SPELLING.get(spelling.replace("lbs", "lb"), spelling)
    # A dot or hyphen between symbols is a product: N.m and oz-in become N m and oz in.
    spelling = re.sub(r"(?<=[A-Za-z0-9])[.-](?=[A-Za-z])", " ", spelling)
    spelling = re.sub(r"[A-Za-z]+", lambda symbol_match: _respell_symbol(symbol_match[0], known_symbols), spelling)
    return _TORQUE_BY_SPELLING.get(spelling, spelling)


def find_nearest_unit(text: str, known_symbols: Collection[str]) -> str:
    """Find the unit with each unknown symbol replaced by the nearest known one, and without a negative power behind a
    slash (m/s^-2 becomes m/s^2); empty where no known symbol is similar to one of the unknown ones."""
    spelling = re.sub(
        r"(/[A-Za-z]+)\^-([1-9])",
        lambda match: match[1] + f"^{match[2]}".removesuffix("^1"),
        respell(text, known_symbols),
    )
    words = re.findall(r"[A-Za-z%]+", spelling)
    replacements = {word: _find_nearest_symbol(word, known_symbols, len(words) == 1) for word in words}
    return re.sub(r"[A-Za-z%]+", lambda word: replacements[word[0]], spelling) if all(replacements.values()) else ""


def _convert_to_ascii(text: str) -> str:
    """Replace the signs of `_ASCII_BY_SIGN` in a text."""
    return "".join(_ASCII_BY_SIGN.get(character, character) for character in text)


def _respell_symbol(word: str, known_symbols: Collection[str]) -> str:
    """Replace a symbol by its known spelling; unchanged where none is listed. In words of up to two letters the case
    counts, because it distinguishes units (`mS`, `MM`)."""
    return word if word in known_symbols else _SYMBOL_BY_SPELLING.get(word.lower() if len(word) > 2 else word, word)


def _find_nearest_symbol(word: str, known_symbols: Collection[str], is_whole_unit: bool) -> str:
    """Find the known symbol with the most similar spelling; empty where none is similar. is_whole_unit: whether the
    word is the whole unit."""
    if word in known_symbols:
        return word
    if len(word) == 1 and word.isupper():
        return _SUGGESTED_WHOLE_UNIT.get(word.lower(), "") if is_whole_unit else ""
    ordered_symbols = sorted(
        known_symbols, key=lambda symbol: (len(symbol), symbol.islower(), symbol[0] == word[0], symbol)
    )
    # Of symbols that are equal in lower case, the last in this order is suggested: `mm` for `MM`, not `Mm`; `MPa` for
    # `Mpa`.
    symbol_by_spelling = {
        **_SYMBOL_BY_SPELLING,
        **{symbol.lower(): symbol for symbol in ordered_symbols},
        **_SUGGESTED_UNIT,
    }
    symbol_by_spelling |= _SUGGESTED_WHOLE_UNIT if is_whole_unit else {}
    matches = get_close_matches(
        word.lower(),
        symbol_by_spelling,
        n=1,
        cutoff=_LEAST_SIMILARITY if is_whole_unit else _LEAST_SIMILARITY_IN_PRODUCT,
    )
    return symbol_by_spelling[matches[0]] if matches else ""
