"""Dialog that confirms a participant's withdrawal of consent before data are erased.

The participant's code must be typed, so that no single key erases data. The dialog itself erases nothing.
"""

from study.tui.screens.typed_confirmation import TypedConfirmation

HELP = """\
# Withdrawal

A participant withdraws the consent. All sessions of this code in this data folder are erased for good: answers,
recordings, tables and figures, and the analysis of the folder, which was made from them too. A tombstone with the
session's name stays, so that the code is not given again.

Type the code and press Enter to erase. **Esc** leaves everything as it is.

In a terminal: `hapteq withdraw SESSION`.
"""
"""Help page of the dialog, in Markdown."""


class WithdrawPrompt(TypedConfirmation):
    """Asks for the participant's code. subject: that code."""

    HELP = HELP
    DEFAULT_CSS = "WithdrawPrompt Card { width: 70; }"

    def __init__(self, subject: str) -> None:
        paragraphs = (
            f"All sessions of {subject} in this data folder are erased for good: answers, recordings, tables "
            f"and figures, and the folder's analysis, which was made from them too.",
            f"To erase, type the code {subject} and press Enter.",
        )
        super().__init__(
            subject, f"{subject} withdraws", paragraphs, lambda: f"That is not {subject}. Nothing was erased."
        )
