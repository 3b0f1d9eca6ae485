"""Rules of a session, without files, clocks or screens: from logged facts to the next action.

A session is the whole procedure of one participant, and one folder. A sitting is one stretch of it at the device, from
the start or a resumption to the next interruption or the end; a session that is interrupted has several.

`facts` (the lines of events.jsonl) -> `state` (the state that follows from them, and the state machine that gives the
next action) -> `stimulus` (what the device has to play). `views` has what the screen of a participant and lists of
sessions may show, `watching` what an experimenter may see. Begin at `state/machine.py` and `state/fold.py`.
"""
