"""Measured quantities by the words in channel names, from headers and maps.

Words of other languages are further entries of the table; those in other scripts are in `study.importing`. French
`tension` is left out: in English it is a force.
"""

import re
import unicodedata

QUANTITY_WORDS = {
    "force": "force load thrust fuerza kraft",
    "torque": "torque moment tau drehmoment",
    "position": "position pos displacement disp stroke travel encoder posición posicion desplazamiento lage weg "
    "déplacement deplacement",
    "angle": "angle theta phi yaw pitch roll ángulo angulo winkel",
    "velocity": "velocity vel speed omega rpm velocidad geschwindigkeit drehzahl vitesse",
    "acceleration": "acceleration accel acc aceleración aceleracion beschleunigung accélération",
    "voltage": "voltage volt volts voltaje tensión spannung",
    "current": "current corriente strom courant",
    "temperature": "temperature temp",
    "pressure": "pressure",
    "humidity": "humidity",
    "setting": "setting",
}
_QUANTITY = {word: quantity for quantity, words in QUANTITY_WORDS.items() for word in words.split()}
_LARGE, _SMALL = "A-ZÀ-ÖØ-Þ", "a-zß-öø-ÿ"
_WORD = re.compile(f"[{_LARGE}]?[{_SMALL}]+|[{_LARGE}]+(?![{_SMALL}])")
_DERIVATIVE = "rate"
"""Word behind an angle that makes it an angular velocity: `yaw rate`."""
_AMBIGUOUS = frozenset(
    ["dot", "ddot", "d", "delta", "diff", "rate", "error", "gyro", "pedal", "time", "ratio", "mode", "limit"]
)
"""Words that make the quantity ambiguous: `theta_dot`, `gyro pitch`, `travel time`."""
SEVERAL_MEANINGS = frozenset(["spannung", "tensión", "yaw", "pitch", "roll"])
"""Words that also name a stress, a distance or an angular velocity: a stated unit decides."""


def words_in(name: str) -> list[str]:
    """Words of a name in lower case: two each of `Yaw_Rate`, `motorSpeed` and `load angle`."""
    return [word.lower() for word in _WORD.findall(unicodedata.normalize("NFC", name))]


def quantity_in(name: str) -> str:
    """The quantity, by the last word that names one: a load angle is an angle. Empty where no word does, or another
    word makes it ambiguous."""
    words = words_in(name)
    last = max((index for index, word in enumerate(words) if word in _QUANTITY), default=None)
    if last is None:
        return ""
    quantity = _QUANTITY[words[last]]
    if quantity == "angle" and words[last + 1 : last + 2] == [_DERIVATIVE]:
        quantity = "velocity"
        del words[last + 1]
    return "" if _AMBIGUOUS & set(words) else quantity
