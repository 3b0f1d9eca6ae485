"""Was direction the cue? What else differed between the directions as delivered, and whether answers followed it.

Begin at `cue_findings.py`.
"""
