"""All English texts for participants by key, and the placeholders that a translation of each must contain.

Merges the tables of the modules `english_*`.
"""

from string import Formatter

from protocols.wording.english_facts import FACTS
from protocols.wording.english_forms import FORM_TEXTS, PROTOCOL_TEXTS
from protocols.wording.english_help import HELP_PAGES
from protocols.wording.english_screens import SCREEN_TEXTS

ENGLISH: dict[str, str] = {**SCREEN_TEXTS, **FORM_TEXTS, **FACTS, **HELP_PAGES, **PROTOCOL_TEXTS}
"""English text of every key; a complete translation has exactly these keys."""

LANGUAGES = {"en": "English", "de": "German", "es": "Spanish"}
"""Names of the languages supplied with hapteq, by code (ISO 639-1)."""


def list_placeholders(text: str) -> frozenset[str] | None:
    """List the names of the placeholders `{name}` in a text; None where braces are unpaired, or contain no name or
    more than a name, such as a format or a conversion."""
    try:
        placeholders = [
            (name, format_spec, conversion)
            for _, name, format_spec, conversion in Formatter().parse(text)
            if name is not None
        ]
    except ValueError:
        return None
    if any(format_spec or conversion or not name.isidentifier() for name, format_spec, conversion in placeholders):
        return None
    return frozenset(name for name, _, _ in placeholders)
