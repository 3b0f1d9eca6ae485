"""What the data say. Pure: trials and recordings in, results, figures and pages out; knows no files and no screens.

Rooms: `psychophysics` (trials -> thresholds and statistics), `look` (recordings before any model), `diagnosis`
(recordings and a model -> the physics that the model lacks), `evaluation` (how good the answers are); `figures` and
`reports` show what they found. Begin at `psychophysics/study_analysis.py` or `diagnosis/diagnose.py`.

Decisions:

2026-11-21. The published one-way analysis is computed as published, and the one within participants stands beside it
with the difference in words: readers need both, the first to compare, the second to believe.
2026-11-22. A threshold with a peak at the cap is called cut by the cap, and no lower bound: it lies above the true
threshold in some runs. The mark is set by peaks at the cap; comparing the mean with the cap would miss
every guesser (they end near 2.7 N of 3 N). `psychophysics.thresholds.is_censored` has the measured operating
characteristics.
"""
