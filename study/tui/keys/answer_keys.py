"""Keys that answer 1 and 2 beside the digits themselves, as `--keys f,j` names them."""

from dataclasses import dataclass

from protocols.wording.words import ENGLISH_WORDS, Words
from study.errors import WrongUseError

RESERVED = "pqrn?"
"""Pause, leave, repeat, note, help: always available during a trial."""


@dataclass(frozen=True, slots=True)
class AnswerKeys:
    """The keys that answer 1 and 2."""

    first: str = "1"
    second: str = "2"

    def answer(self, typed: str) -> int | None:
        """1 or 2; None for other keys. The digits are always valid; case is ignored."""
        key = typed.casefold()
        if key in ("1", self.first):
            return 1
        return 2 if key in ("2", self.second) else None

    def choice(self, words: Words = ENGLISH_WORDS) -> str:
        """Keys in a prompt, such as "f for 1, j for 2"; "1 or 2" by default."""
        if (self.first, self.second) == ("1", "2"):
            return words["keys_digits"]
        return words.fill("keys_named", {"first": self.first, "second": self.second})


DIGITS = AnswerKeys()
"""The digits alone."""


def parse_keys(text: str) -> AnswerKeys:
    """Parse two keys such as "f,j": the key for 1, then the key for 2. Raises WrongUseError."""
    keys = [part.strip().casefold() for part in text.split(",")]
    if len(keys) != 2:
        raise _refusal(f"'{text}' names {len(keys)} of them")
    first, second = keys
    for key in keys:
        if len(key) != 1 or not key.isprintable():
            raise _refusal(f"'{key}' is {'nothing' if not key else 'more than one character'}")
        if key in RESERVED:
            raise _refusal(f"'{key}' has another meaning in a trial")
    if first == second:
        raise _refusal(f"'{first}' cannot stand for both")
    if first == "2" or second == "1":
        raise _refusal("the digits 1 and 2 always stand for themselves")
    return AnswerKeys(first, second)


def _refusal(why: str) -> WrongUseError:
    return WrongUseError(
        "These answer keys cannot be used",
        f"{why[0].upper()}{why[1:]}.",
        f"Name two different characters, such as --keys f,j; not {' '.join(RESERVED)}. 1 and 2 work in any case.",
    )
