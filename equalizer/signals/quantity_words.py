"""Detection of a channel's measured quantity from the words in its name.

Called by the import of files (`study.importing`) and the diagnosis (`analysis.diagnosis.first_model`). Words of other
languages are further entries of the table; those in other scripts are in `study.importing`. French `tension` is left
out: in English it is a force.
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
"""Words, separated by blanks, that name each quantity, in lower case."""
_QUANTITY_BY_WORD = {word: quantity for quantity, words in QUANTITY_WORDS.items() for word in words.split()}
_UPPER, _LOWER = "A-ZÀ-ÖØ-Þ", "a-zß-öø-ÿ"
"""Capital and small Latin letters, as ranges of a regular expression."""
_WORD = re.compile(f"[{_UPPER}]?[{_LOWER}]+|[{_UPPER}]+(?![{_LOWER}])")
"""A word: small letters, with a capital in front or not, or capitals that no small letter follows."""
_RATE_WORD = "rate"
"""Word after an angle that makes it an angular velocity: `yaw rate`."""
_AMBIGUOUS_WORDS = frozenset(
    ["dot", "ddot", "d", "delta", "diff", "rate", "error", "gyro", "pedal", "time", "ratio", "mode", "limit"]
)
"""Words that make the quantity ambiguous: `theta_dot`, `gyro pitch`, `travel time`."""
WORDS_NEEDING_UNIT = frozenset(["spannung", "tensión", "yaw", "pitch", "roll"])
"""Words that also name a stress, a distance or an angular velocity: a stated unit decides."""


def split_into_words(name: str) -> list[str]:
    """Split a name into its words, in lower case and Unicode normal form C; digits and signs are left out. `Yaw_Rate`,
    `motorSpeed` and `load angle` contain two words each."""
    return [word.lower() for word in _WORD.findall(unicodedata.normalize("NFC", name))]


def detect_quantity(name: str) -> str:
    """Detect the quantity (a key of `QUANTITY_WORDS`) by the last word that names one: a load angle is an angle. An
    angle followed by the word `rate` is a velocity. Empty where no word names a quantity, or another word makes it
    ambiguous (`_AMBIGUOUS_WORDS`)."""
    words = split_into_words(name)
    last_index = max((index for index, word in enumerate(words) if word in _QUANTITY_BY_WORD), default=None)
    if last_index is None:
        return ""
    quantity = _QUANTITY_BY_WORD[words[last_index]]
    if quantity == "angle" and words[last_index + 1 : last_index + 2] == [_RATE_WORD]:
        quantity = "velocity"
        del words[last_index + 1]
    return "" if _AMBIGUOUS_WORDS & set(words) else quantity
