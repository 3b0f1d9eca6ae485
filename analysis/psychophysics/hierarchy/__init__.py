"""The primary analysis: one hierarchical psychometric model of all answers of a study.

`answers` (counted by cell) and `curve` (psychometric function) -> `likelihood` -> `marginal` (Laplace's method) ->
`objective` (its maximum) -> `quadrature_search` (the maximum by `quadrature` over `nodes`) -> `fit` -> `inference`
(medians, direction limit) and `goodness` -> `primary`, which calls all of them. `likelihood_thresholds` fits each run
alone, `single_persons` a participant alone, `observed_shares` computes the points of figures. Used by `study_analysis`
and `power`. Begin at `primary.py`, then `fit.py`."""
