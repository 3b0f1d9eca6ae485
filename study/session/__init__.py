"""Rules of a sitting, without files, clocks or screens: from logged facts to the next action.

`facts` (the lines of events.jsonl) -> `state` (their fold, and the state machine that gives the next action) ->
`stimulus` (what the device has to play); `views` is what a participant or a list may see, `watching` what an
experimenter may. Begin at `state/machine.py` and `state/fold.py`.
"""
