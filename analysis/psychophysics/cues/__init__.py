"""Was direction the cue? What else differed between the directions as delivered, and whether answers followed it.

`delivered_cues` (what differed, from the recordings) -> `answers_on_delivery` (logistic regression of the answers on
it) -> `cue_findings` (sentences). Begin at `cue_findings.py`.
"""
