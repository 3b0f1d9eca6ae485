"""Base class of the participant's screens: texts, footer and help in the language of the protocol."""

from dataclasses import replace
from typing import ClassVar, TypeVar

from textual.binding import ActiveBinding
from textual.screen import Screen

from protocols.wording.words import ENGLISH_WORDS, Words

Reply = TypeVar("Reply")


class TranslatedScreen(Screen[Reply]):
    """A screen with the texts `words`. Descriptions and key names of its bindings are written in English in the code
    and translated when the footer reads them."""

    PAGE: ClassVar[str] = ""
    """Key of the screen's help page in the words."""

    def __init__(self, words: Words = ENGLISH_WORDS) -> None:
        super().__init__()
        self.words = words

    @property
    def HELP(self) -> str:  # type: ignore[override]  # noqa: N802  a class attribute elsewhere
        """Text of the help (Markdown): the entry `PAGE` of the words."""
        return self.words[self.PAGE]

    @property
    def active_bindings(self) -> dict[str, ActiveBinding]:
        return {key: self._in_words(active) for key, active in super().active_bindings.items()}

    def _in_words(self, active: ActiveBinding) -> ActiveBinding:
        binding, key_display = active.binding, active.binding.key_display
        translated = replace(
            binding,
            description=self.words.translate_key(binding.description),
            key_display=key_display and self.words.translate_key(key_display),
        )
        return active._replace(binding=translated)
