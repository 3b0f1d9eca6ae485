"""Base class of screens for the participant: texts, footer and help in the language of the protocol."""

from dataclasses import replace
from typing import ClassVar, TypeVar

from textual.binding import ActiveBinding
from textual.screen import Screen

from protocols.wording.words import ENGLISH_WORDS, Words

Reply = TypeVar("Reply")


class TranslatedScreen(Screen[Reply]):
    """Screen with texts in the language of `words`. Descriptions and key names of its bindings are written in English
    in the code and translated when the footer reads them."""

    PAGE: ClassVar[str] = ""
    """Key of the screen's help page in the words."""

    def __init__(self, words: Words = ENGLISH_WORDS) -> None:
        super().__init__()
        self.words = words

    @property
    def HELP(self) -> str:  # type: ignore[override]  # noqa: N802  a class attribute elsewhere
        """Text of the help, in Markdown."""
        return self.words[self.PAGE]

    @property
    def active_bindings(self) -> dict[str, ActiveBinding]:
        """Bindings that are active now, by key, with translated descriptions."""
        return {key: self._translate_binding(active_binding) for key, active_binding in super().active_bindings.items()}

    def _translate_binding(self, active_binding: ActiveBinding) -> ActiveBinding:
        """Translate the description of a binding and, if there is one, the displayed name of its key."""
        binding, key_display = active_binding.binding, active_binding.binding.key_display
        translated_binding = replace(
            binding,
            description=self.words.translate_key(binding.description),
            key_display=key_display and self.words.translate_key(key_display),
        )
        return active_binding._replace(binding=translated_binding)
