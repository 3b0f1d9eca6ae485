"""Lookup of every text that is shown to a participant: the protocol's own text, or the English one where it has none.

Sentences that a session composes itself are logged in English; `Words.fact` recognises them by pattern and gives their
translation.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from protocols.wording.english import ENGLISH, placeholders
from protocols.wording.english_facts import FACTS
from protocols.wording.english_screens import SCREENS

KEYS = {text: key for key, text in SCREENS.items() if key.startswith("key_")}
"""Key of each word in the footer (what a keyboard key does), by its English text."""


def _compile_pattern(text: str) -> re.Pattern[str]:
    """Regular expression for a fact whose placeholders are filled in; each placeholder becomes a named group."""
    parts = re.split(r"\{(\w+)\}", text)  # plain text and names of placeholders alternate
    groups = (f"(?P<{part}>.+?)" if place % 2 else re.escape(part) for place, part in enumerate(parts))
    return re.compile("".join(groups), re.DOTALL)


PATTERNS = {
    key: _compile_pattern(text) for key, text in sorted(FACTS.items(), key=lambda fact: ("{" in fact[1], -len(fact[1])))
}
"""Patterns of all facts in the order in which they are tried: exact sentences first, then the longest, so that a short
pattern does not match a part of a longer sentence."""


@dataclass(frozen=True, slots=True)
class Words:
    """The texts of one protocol in one language."""

    own: Mapping[str, str] = field(default_factory=dict, hash=False)
    """The protocol's own texts by key. The English text is used for a missing key or an empty text."""

    def __getitem__(self, key: str) -> str:
        return self.own.get(key) or ENGLISH[key]

    def fill(self, key: str, values: Mapping[str, object]) -> str:
        """The text with its placeholders filled in. The English text is shown where the placeholders of the own text
        differ (from another version of hapteq), so that no sentence is missing on the screen."""
        fitting = placeholders(self[key]) == placeholders(ENGLISH[key])
        return (self[key] if fitting else ENGLISH[key]).format_map(values)

    def fill_count(self, key: str, count: int) -> str:
        """The text in the singular for a count of 1, else in the plural."""
        return self[f"{key}_1"] if count == 1 else self.fill(f"{key}_n", {"count": count})

    def key(self, english: str) -> str:
        """The footer's word for a keyboard key; unchanged where it is not in `KEYS`, as on the experimenter's
        screens."""
        return self[KEYS[english]] if english in KEYS else english

    def fact(self, english: str) -> str:
        """Translation of a sentence that a session composed in English; unchanged where it matches no pattern."""
        for key, pattern in PATTERNS.items():
            match = pattern.fullmatch(english)
            if match is not None:
                return self.fill(key, {name: self._fill_part(part) for name, part in match.groupdict().items()})
        return english

    def _fill_part(self, part: str) -> str:
        """Translation of a value in a fact: itself a fact, a list of facts separated by commas, or unchanged (a
        number)."""
        return ", ".join(self.fact(item) for item in part.split(", ")) if self.fact(part) == part else self.fact(part)


ENGLISH_WORDS = Words()
"""The English texts, without any of a protocol's own."""
