"""Errors of a model with effects against measurements, and the fit that minimises them.

`choose_measure` makes an error measure (protocol: `error_measure`): `free_simulation`, `windows`, or forces along the
motion, by `error_measure_rule`; `whitened_measure` is the one for clean recordings -> `tuning` (free parameters of the
model), `hypothesis` or `law_hypothesis` (those of added effects) -> `output_error` (fits both by least squares) ->
`fit_score`, `standard_errors`; `evidence_from_residuals` converts residuals to a missing force. For impacts,
`band_power` and `band_power_fit` take the place of measure and fit (data: `excited_segments`; all parameters together:
`refine_band_power`). `prediction_error` gives the error of a model whose parameters are not fitted. Used by
`localisation`, `search` and all later steps. Begin at `choose_measure.py`.
"""
