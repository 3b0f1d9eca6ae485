"""Keys that answer 1 and 2 in addition to the digits themselves, as chosen by the option `--keys f,j`."""

from dataclasses import dataclass

from protocols.wording.words import ENGLISH_WORDS, Words
from study.errors import WrongUseError

RESERVED = "pqrn?"
"""Keys that have another meaning in every trial: p pause, q leave, r repeat, n note, ? help."""


@dataclass(frozen=True, slots=True)
class AnswerKeys:
    """The keys that answer 1 and 2, as lower-case characters."""

    first: str = "1"
    second: str = "2"

    def answer(self, character: str) -> int | None:
        """The answer 1 or 2 of a typed character; None for any other. The digits are always valid; case is ignored."""
        key = character.casefold()
        if key in ("1", self.first):
            return 1
        return 2 if key in ("2", self.second) else None

    def choice(self, words: Words = ENGLISH_WORDS) -> str:
        """Text on the keys for a prompt, such as "f for 1, j for 2"; "1 or 2" for the digits."""
        if (self.first, self.second) == ("1", "2"):
            return words["keys_digits"]
        return words.fill("keys_named", {"first": self.first, "second": self.second})


DIGITS = AnswerKeys()
"""Answers by the digits only."""


def parse_keys(text: str) -> AnswerKeys:
    """Parse two keys such as "f,j": the key for 1, then the key for 2. Raises WrongUseError unless they are two
    different printable characters that are not reserved and do not exchange the digits."""
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


def _refusal(reason: str) -> WrongUseError:
    """The error for invalid keys. reason: the reason, a sentence without capital letter and full stop."""
    return WrongUseError(
        "These answer keys cannot be used",
        f"{reason[0].upper()}{reason[1:]}.",
        f"Name two different characters, such as --keys f,j; not {' '.join(RESERVED)}. 1 and 2 work in any case.",
    )
