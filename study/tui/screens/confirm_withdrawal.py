"""Confirmation of a withdrawal of consent during a sitting, which erases the participant's data. A word must be typed,
in the language of the protocol."""

from protocols.wording.words import ENGLISH_WORDS, Words
from study.tui.screens.typed_confirmation import TypedConfirmation


class ConfirmWithdrawal(TypedConfirmation):
    """Asks the participant to type the word, in upper or lower case. The caller erases the data."""

    PAGE = "help_withdraw"

    def __init__(self, words: Words = ENGLISH_WORDS) -> None:
        word = {"word": words["withdraw_word"]}
        paragraphs = (words["withdraw_all"], words.fill("withdraw_how", word))
        super().__init__(
            words["withdraw_word"],
            words["withdraw_title"],
            paragraphs,
            lambda: words.fill("withdraw_other", word),
            words,
        )

    def is_word(self, text: str) -> bool:
        return self.words.is_typed("withdraw_word", text)
