"""Rules of a session, without files, clocks or screens: from logged events to the next action.

A session is the whole procedure of one participant, and one folder. A sitting is one continuous part of it at the
device, from the start or a resumption to the next interruption or the end; a session that is interrupted has several.

`facts` (the logged events, lines of events.jsonl) -> `state` (the state that follows from them, and the state machine
that gives the next action) -> `stimulus` (what the device has to play). `views` has the values that the screen of a
participant and lists of sessions may show, `watching` those that an experimenter may see. Used by `study.workflows`,
`study.tui` and `study.devices`. Begin at `state/machine.py` and `state/fold.py`.
"""
