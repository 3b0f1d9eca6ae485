"""Symbolic regression: which formula of the motion and the commands a model lacks, where no catalogue effect fits.

In this order: `grammar` and `view_terms` list the terms, `matched_filter` turns a fit's residuals into what a force
along one axis, or an error of one reading, could have made of them, `screen_terms` and `beam` rank terms and sums by
held-out error, with their free numbers fitted (`fit_sum`); `antisymmetric_pairs` joins forces of two axes on each
other; `discover` fits the best by output error (`fit_laws`), one law after another, and `snap_exponents` writes plain
exponents; `proof` says what must hold before a law may be said, and `add_laws` puts it in the place of names that it
beats.
"""
