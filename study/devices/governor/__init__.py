"""What keeps every force within its limits, for every caller.

Each tick: `plausibility` of the readings, `feedback` (spring and damper) within `confine`, then the caps of `govern`;
compiled (`compiling`), its state in `cells`. `governor.py` is its face. Begin at `govern.py`.
"""
