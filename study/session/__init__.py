"""Rules of a session, without files, clocks or screens: from logged facts to the next action.

A session is one participant's whole procedure, and one folder. A sitting is one stretch of it at the device, from its
opening, or from being resumed, to its end; a session that is interrupted has several.

`facts` (the lines of events.jsonl) -> `state` (their fold, and the state machine that gives the next action) ->
`stimulus` (what the device has to play); `views` is what a participant or a list may see, `watching` what an
experimenter may. Begin at `state/machine.py` and `state/fold.py`.
"""
