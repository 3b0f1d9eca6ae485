"""All English texts by key, and what may stand in a translation of each."""

from string import Formatter

from protocols.wording.english_facts import FACTS
from protocols.wording.english_forms import FORMS, PROTOCOLS
from protocols.wording.english_help import HELP
from protocols.wording.english_screens import SCREENS

ENGLISH: dict[str, str] = {**SCREENS, **FORMS, **FACTS, **HELP, **PROTOCOLS}

LANGUAGES = {"en": "English", "de": "German", "es": "Spanish"}
"""Languages that come with hapteq, by their code (ISO 639-1)."""


def placeholders(text: str) -> frozenset[str] | None:
    """The names in braces; None where the braces are not in pairs, or hold more than a name."""
    try:
        parts = [(name, spec, conversion) for _, name, spec, conversion in Formatter().parse(text) if name is not None]
    except ValueError:
        return None
    if any(spec or conversion or not name.isidentifier() for name, spec, conversion in parts):
        return None
    return frozenset(name for name, _, _ in parts)
