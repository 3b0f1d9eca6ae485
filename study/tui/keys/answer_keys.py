"""Keyboard keys for the answers 1 and 2 in addition to the digits, as chosen by the option `--keys f,j`."""

from dataclasses import dataclass

from protocols.wording.words import ENGLISH_WORDS, Words
from study.errors import WrongUseError

RESERVED_KEYS = "pqrn?"
"""Keys with another meaning in a session: p pause, q leave, r repeat, n note, ? help."""


@dataclass(frozen=True, slots=True)
class AnswerKeys:
    """The additional keys for the answers 1 and 2, as case-folded characters; the digits themselves by default."""

    first: str = "1"
    second: str = "2"

    def parse_answer(self, character: str) -> int | None:
        """Parse a typed character: the answer 1 or 2, None for any other. The digits are always valid; case is
        ignored."""
        key = character.casefold()
        if key in ("1", self.first):
            return 1
        return 2 if key in ("2", self.second) else None

    def describe_keys(self, words: Words = ENGLISH_WORDS) -> str:
        """Describe the keys for a prompt, such as "f for 1, j for 2"; "1 or 2" for the digits."""
        if (self.first, self.second) == ("1", "2"):
            return words["keys_digits"]
        return words.fill("keys_named", {"first": self.first, "second": self.second})


DIGITS = AnswerKeys()
"""Answers by the digits only."""


def parse_keys(text: str) -> AnswerKeys:
    """Parse two keys such as "f,j": the key for 1, then the key for 2. Raises WrongUseError unless they are two
    different printable characters that are not reserved and do not exchange the digits."""
    keys = [key_text.strip().casefold() for key_text in text.split(",")]
    if len(keys) != 2:
        raise _make_keys_error(f"'{text}' names {len(keys)} of them")
    first, second = keys
    for key in keys:
        if len(key) != 1:
            raise _make_keys_error(f"'{key}' is {'nothing' if not key else 'more than one character'}")
        if not key.isprintable():
            raise _make_keys_error(f"{key!a} is not printable")
        if key in RESERVED_KEYS:
            raise _make_keys_error(f"'{key}' has another meaning in a trial")
    if first == second:
        raise _make_keys_error(f"'{first}' cannot stand for both")
    if first == "2" or second == "1":
        raise _make_keys_error("the digits 1 and 2 always stand for themselves")
    return AnswerKeys(first, second)


def _make_keys_error(reason: str) -> WrongUseError:
    """Make the error for invalid keys. reason: a sentence without initial capital and full stop."""
    return WrongUseError(
        "These answer keys cannot be used",
        f"{reason[0].upper()}{reason[1:]}.",
        f"Name two different characters, such as --keys f,j; not {' '.join(RESERVED_KEYS)}. 1 and 2 work in any case.",
    )
