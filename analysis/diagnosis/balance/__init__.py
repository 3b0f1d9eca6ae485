"""The force balance along a measured motion: linear regression of the force on many laws at once, before any model.

Data pass through `motion` (positions, velocities and accelerations of a recording, in the band that its noise allows)
-> `laws` (candidate terms in addition to mass, damping and stiffness) -> `regression` (filters all terms alike and
holds their products block by block) -> `structures` (beam search over sums of one to three laws; selects the one with
the fewest parameters that fits about as well as the best) -> `compare_free_laws` (puts a formula outside the catalogue
in their place where it halves the error) -> `judge_laws` (decides on held-out data which laws are named, which are
candidates, and which the data cannot distinguish). `balances` runs all of them. Begin at `judge_laws.py`.
"""
