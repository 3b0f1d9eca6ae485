"""Help texts of the experimenter's view (`study.tui.watch.watch_screen`): its keys, and the meaning of its panels."""

KEY_GUIDE = "You only watch: S stops, p pauses, n notes. Directions show after the answer."
"""The most important keys, as one line of the view."""

HELP = """\
# Watching a session

You follow a running session. Nothing here changes it, apart from four keys:

* **S** (shift and s) or **F8**: stop. The force is off at once; nothing is asked. The session can be resumed.
* **p**: pause. Hands free at once; the participant continues at their own screen.
* **n**: a note for the log. **e**: an adverse event (pain, numbness, a fright).

The other keys: **a** says that you have seen the alarms, **d** shows forms, practice and notes, **t** goes through
light, dark and high contrast, **q** leaves the view; the session continues.

## What you see

* **Staircase**: force over trials. ○ right, × wrong, ▼ and ▲ reversals, ? the next level.
* **Last trials**: the newest on top. *shown* and *said* are the numbers 1 and 2; *s* is the time to answer; *m/s²* is \
the delivered acceleration along the direction, *off* across it. ↺ marks a reversal, + a repeated trial, ! a remark \
(shown in a wider window).
* **Runs**: *rev.* counts reversals, *n* trials.
* **A(8)**: today's vibration dose after ISO 5349-1, and the limit of this protocol.
* **Catch**: trials at full force that every participant should get right; errors in them are lapses of attention.

The direction of a trial stays hidden until its answer counts, so that you cannot give it away.
"""
"""Help page of the view, in Markdown."""
