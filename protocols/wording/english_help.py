"""English help pages of the participant's screens (F1), in Markdown, by key.

The key of a page is `help_` and the name of the screen; `help_title` is the title of all, `help_everywhere` is appended
to each. Merged into `english.ENGLISH`; a translation has the same keys (`translation`).
"""

HELP_PAGES: dict[str, str] = {
    "help_title": "Help",
    "help_instructions": """\
# Instructions

- This page says what happens in a trial and how to answer. Arrow keys scroll it.
- **Enter** begins.
- Ask the experimenter if anything is unclear; nothing moves before you go on.
- **Ctrl+C** leaves.
""",
    "help_trial": """\
# A trial

- Feel the handle as long as you like, then press 1 or 2 for the direction along which it shakes. If the question is
  about two intervals, press the number of the interval in which it shook.
- If you are not sure, guess. Many trials are meant to be hard, and no answer can do harm.
- **p** pauses: the handle stops at once, and this trial comes again afterwards.
- **r** plays this trial again, for instance when you were disturbed. This works a few times in each run.
- **q** pauses too, and offers to leave. What you have answered is kept.
- **Ctrl+C** takes the force off at once and leaves.
""",
    "help_rest": """\
# Rest

- Let go of the handle and relax your hand. Nothing is played.
- The rest is part of the study: a tired hand feels less. It cannot be shortened.
- When it is over, take as long as you like, and press **Enter** to continue.
- **Ctrl+C** leaves; the session can be resumed.
""",
    "help_pause": """\
# Pause

- Nothing is played, and the handle is free. Take as long as you like.
- **Up** and **Down** move through the choices, **Enter** takes the highlighted one.
- **n** writes a note into the log; **e** reports that something happened to the participant.
- Leaving keeps every answer: the session can be resumed at this trial.
- Withdrawing the consent erases all data of this participant; the program asks once more before it does.
""",
    "help_practice": """\
# End of a practice

- The practice shows what each vibration feels like. Its answers enter no result.
- Some vibrations are hard to tell for everyone. The study continues in any case.
- **Enter** continues.
""",
    "help_demo": """\
# Demonstration

- **1** and **2** play that direction, as often as you like. Nothing is asked, nothing is recorded as an answer.
- **Left** and **Right** (or **b** and **n**) change the vibration: 1 is the slowest.
- What you have felt already is marked with a tick.
- **Enter** ends the demonstration; it asks once if something was not felt yet.
""",
    "help_handle": """\
# The handle's place

- The ring is where a trial may start; the spot is your handle.
- Move it into the ring and hold it there loosely. The trial then begins by itself.
- **p** pauses, **q** pauses and offers to leave.
- If the spot never moves, tell the experimenter: the device may have lost its handle.
""",
    "help_playing": """\
# Only feel

- You now feel the interval or direction that is framed on the screen. It ends by itself.
- No answer is needed yet: it is asked for afterwards.
- **p** pauses at once; **q** pauses and offers to leave.
""",
    "help_void": """\
# A trial that did not count

- The last trial was interrupted and does not count. It is repeated, so nothing is lost.
- Nothing is played until you press **Enter**.
- **Ctrl+C** leaves; the session can be resumed.
""",
    "help_goodbye": """\
# The end

- The device is still, and every answer is on the disk.
- A session that is not finished can be resumed another day, at the trial where it stopped.
- **Enter** closes this page.
""",
    "help_withdraw": """\
# Withdrawing the consent

- A participant may withdraw the consent at any time, without giving a reason.
- Everything recorded of this participant is then erased, and cannot be brought back.
- Type the word and press **Enter** to erase. **Esc** keeps everything.
""",
    "help_form": """\
# A form

- **Up**, **Down** and **Tab** go from question to question.
- A choice is made by its number, by its first letter, or with **Left**, **Right** and **Space**.
- **Enter** chooses what is highlighted and goes to the next question.
- **Continue** is below the last question. It says which answers are missing.
- You may ask the experimenter about anything that is unclear. **Ctrl+C** leaves.
""",
    "help_note": """\
# A note

- Write what should be known about this session later. No names: the log is kept with the data.
- **Tab** moves on to who writes it, and whether something happened to the participant.
- **Ctrl+S** or the button writes it into the log; **Esc** leaves without writing.
- If a person was hurt, leave the handle alone and look after the participant first.
""",
    "help_check": """\
# Device check

- Each line is one finding: **ok**, **warn** or **LOOK** (needs attention), with what to do about it.
- **c** checks again, after something was plugged in or repaired.
- **Enter** continues if every finding is ok; **g** continues although a finding needs attention.
- The findings are kept with the data.
""",
    "help_preparing": """\
# Preparing

The program gets the device ready. Nothing moves, and there is nothing to do. The first time on a computer this
takes longer, because the simulated device is compiled.

**Ctrl+Q** leaves; a session that was begun can be resumed.
""",
    "help_everywhere": """\


## On every screen

**F1** help, **Ctrl+P** all commands, **F9** light, dark or high contrast. **Ctrl+C** takes the force off at once and
ends the sitting; nothing that was answered is lost. **Ctrl+Z** suspends the program: no force until you come back.
During a session **F2** shows the experimenter's view (for the experimenter only: it asks for the session's name),
**F4** takes a note.
""",
}
