"""Help that holds on every screen, below the screen's own."""

EVERYWHERE = """

## On every screen

**F1** help, **Ctrl+P** all commands, **F9** light, dark or high contrast. **Ctrl+C** takes the force off at once and
ends the sitting; nothing that was answered is lost. **Ctrl+Z** suspends: the hand is free until you are back.
During a session **F2** shows the experimenter's view (for the experimenter only: it asks for the session's name),
**F4** takes a note.
"""
