"""Lookup of the texts that are shown to a participant: the protocol's text in its language, else the English default.

The screens and the line mode of a session take their texts from here. Facts (`english_facts`) are sentences that a
session composes and logs in English, such as the reason for a void trial; `Words.translate_fact` recognises them by
pattern and translates them.
"""

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, field

from protocols.wording.english import ENGLISH, list_placeholders
from protocols.wording.english_facts import FACTS
from protocols.wording.english_screens import SCREEN_TEXTS

FOOTER_KEYS = {text: key for key, text in SCREEN_TEXTS.items() if key.startswith("key_")}
"""Key of each label in the footer (the action of a keyboard key), by its English text."""


def _compile_pattern(text: str) -> re.Pattern[str]:
    """Compile the regular expression of a fact; each placeholder becomes a named group that matches its value."""
    text_parts = re.split(r"\{(\w+)\}", text)  # plain text and names of placeholders alternate
    pattern_parts = (
        f"(?P<{text_part}>.+?)" if index % 2 else re.escape(text_part) for index, text_part in enumerate(text_parts)
    )
    return re.compile("".join(pattern_parts), re.DOTALL)


FACT_PATTERNS = {
    key: _compile_pattern(text) for key, text in sorted(FACTS.items(), key=lambda fact: ("{" in fact[1], -len(fact[1])))
}
"""Patterns of all facts in the order in which they are tried: exact sentences first, then the longest, so that a short
pattern does not match a part of a longer sentence."""


@dataclass(frozen=True, slots=True)
class Words:
    """The texts of one protocol in one language."""

    protocol_texts: Mapping[str, str] = field(default_factory=dict, hash=False)
    """Texts of the protocol by key. The English text is used for a missing key or an empty text."""

    def __getitem__(self, key: str) -> str:
        """Return the text with this key. Raises KeyError where neither the protocol nor the English texts have it."""
        return self.protocol_texts.get(key) or ENGLISH[key]

    def fill(self, key: str, values: Mapping[str, object]) -> str:
        """Fill in the placeholders of a text. The English text is used where the placeholders of the protocol's text
        differ, as in one for another version of hapteq. Raises KeyError for an unknown key or a missing value."""
        has_same_placeholders = list_placeholders(self[key]) == list_placeholders(ENGLISH[key])
        return (self[key] if has_same_placeholders else ENGLISH[key]).format_map(values)

    def fill_count(self, key: str, count: int) -> str:
        """Fill a count into a text: `<key>_1`, the singular, for a count of 1, else `<key>_n`."""
        return self[f"{key}_1"] if count == 1 else self.fill(f"{key}_n", {"count": count})

    def is_typed(self, key: str, typed: str) -> bool:
        """Whether the typed text is the text with this key, regardless of case, blanks around it, and whether accents
        are encoded as separate characters."""
        typed_word, word = (unicodedata.normalize("NFC", text.strip()).casefold() for text in (typed, self[key]))
        return typed_word == word

    def translate_key(self, english_label: str) -> str:
        """Translate the footer's label of a keyboard key; unchanged where it is not in `FOOTER_KEYS`, as on the
        experimenter's screens."""
        return self[FOOTER_KEYS[english_label]] if english_label in FOOTER_KEYS else english_label

    def translate_fact(self, english_fact: str) -> str:
        """Translate a fact, with the facts in its placeholders; unchanged where it matches no pattern."""
        for key, pattern in FACT_PATTERNS.items():
            match = pattern.fullmatch(english_fact)
            if match is not None:
                return self.fill(key, {name: self._translate_value(value) for name, value in match.groupdict().items()})
        return english_fact

    def _translate_value(self, value: str) -> str:
        """Translate the value of a placeholder: a fact, or facts separated by ", "; other values, such as numbers, stay
        unchanged."""
        return (
            ", ".join(self.translate_fact(sentence) for sentence in value.split(", "))
            if self.translate_fact(value) == value
            else self.translate_fact(value)
        )


ENGLISH_WORDS = Words()
"""The English texts only."""
