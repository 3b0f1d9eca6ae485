"""A screen in the language of the protocol: its texts, the words of its footer, and its help."""

from dataclasses import replace
from typing import ClassVar, TypeVar

from textual.binding import ActiveBinding
from textual.screen import Screen

from protocols.wording.words import ENGLISH_WORDS, Words

Reply = TypeVar("Reply")


class TranslatedScreen(Screen[Reply]):
    """Bindings are written in English; what the footer shows of them is looked up, word by word."""

    PAGE: ClassVar[str] = ""
    """Key of its help page."""

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
        binding, shown = active.binding, active.binding.key_display
        translated = replace(
            binding,
            description=self.words.key(binding.description),
            key_display=shown and self.words.key(shown),
        )
        return active._replace(binding=translated)
