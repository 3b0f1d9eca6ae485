"""All English texts by key, and the placeholders that a translation of each must contain."""

from string import Formatter

from protocols.wording.english_facts import FACTS
from protocols.wording.english_forms import FORMS, PROTOCOLS
from protocols.wording.english_help import HELP
from protocols.wording.english_screens import SCREENS

ENGLISH: dict[str, str] = {**SCREENS, **FORMS, **FACTS, **HELP, **PROTOCOLS}
"""English text of every key; a complete translation has exactly these keys."""

LANGUAGES = {"en": "English", "de": "German", "es": "Spanish"}
"""Names of the languages supplied with hapteq, by code (ISO 639-1)."""


def placeholders(text: str) -> frozenset[str] | None:
    """Names of the placeholders `{name}` in a text; None where braces are unpaired or contain more than a name, such as
    a format or a conversion."""
    try:
        parts = [(name, spec, conversion) for _, name, spec, conversion in Formatter().parse(text) if name is not None]
    except ValueError:
        return None
    if any(spec or conversion or not name.isidentifier() for name, spec, conversion in parts):
        return None
    return frozenset(name for name, _, _ in parts)
