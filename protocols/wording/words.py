"""Lookup of every text that is shown: a protocol's own texts, and the English ones where it has none."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from protocols.wording.english import ENGLISH, placeholders
from protocols.wording.english_facts import FACTS
from protocols.wording.english_screens import SCREENS

KEYS = {text: key for key, text in SCREENS.items() if key.startswith("key_")}
"""Key of a footer's word, by its English text."""


def _pattern(text: str) -> re.Pattern[str]:
    """Pattern of a fact with its braces filled in: each brace becomes a group of its name."""
    parts = re.split(r"\{(\w+)\}", text)  # plain text and names of braces in turn
    groups = (f"(?P<{part}>.+?)" if place % 2 else re.escape(part) for place, part in enumerate(parts))
    return re.compile("".join(groups), re.DOTALL)


PATTERNS = {
    key: _pattern(text) for key, text in sorted(FACTS.items(), key=lambda fact: ("{" in fact[1], -len(fact[1])))
}
"""Patterns of all facts in the order in which they are tried: exact sentences first, then the longest, so that a short
pattern does not match a part of a longer sentence."""


@dataclass(frozen=True, slots=True)
class Words:
    """The texts of one protocol in one language."""

    own: Mapping[str, str] = field(default_factory=dict, hash=False)
    """A protocol's own texts by key. A key that is missing has its English text."""

    def __getitem__(self, key: str) -> str:
        return self.own.get(key) or ENGLISH[key]

    def fill(self, key: str, values: Mapping[str, object]) -> str:
        """The text with its braces filled in. A text whose braces do not fit (of another version) is shown in English,
        because a participant must not lose a sentence."""
        fitting = placeholders(self[key]) == placeholders(ENGLISH[key])
        return (self[key] if fitting else ENGLISH[key]).format_map(values)

    def counted(self, key: str, count: int) -> str:
        """The text in the singular for a count of 1, else in the plural."""
        return self[f"{key}_1"] if count == 1 else self.fill(f"{key}_n", {"count": count})

    def key(self, english: str) -> str:
        """The footer's word for a key; unchanged where it is not a participant's."""
        return self[KEYS[english]] if english in KEYS else english

    def fact(self, english: str) -> str:
        """A sentence of the session; unchanged where it is not meant for participants."""
        for key, pattern in PATTERNS.items():
            found = pattern.fullmatch(english)
            if found is not None:
                return self.fill(key, {name: self._fill_part(part) for name, part in found.groupdict().items()})
        return english

    def _fill_part(self, part: str) -> str:
        """What is filled into a fact: facts themselves, or a number."""
        return ", ".join(self.fact(each) for each in part.split(", ")) if self.fact(part) == part else self.fact(part)


ENGLISH_WORDS = Words()
