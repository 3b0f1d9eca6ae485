"""The rules of a sitting, without any file, clock or screen: from logged facts to what is done next.

`facts` (the lines of events.jsonl) -> `state` (their fold, and the machine that says what is next) -> `stimulus`
(what the device is asked to hold); `views` is what a participant or a list may see, `watching` what an experimenter
may. Begin at `state/machine.py` and `state/fold.py`.
"""
