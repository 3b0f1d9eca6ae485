"""The primary analysis: one hierarchical psychometric model of all answers of a study.

`answers` (counted by cell) and `curve` -> `likelihood` -> `marginal` (Laplace's method) -> `objective` (its maximum) ->
`refine` (the maximum by `quadrature` over `nodes`) -> `fit` -> `inference` (medians, contrasts, direction limit),
`goodness` -> `primary`, which calls all of it. `run_likelihood` fits each run alone, `single_persons` people without
others, `observed_shares` is for figures. Begin at `primary.py`, then `fit.py`.
"""
