"""Errors of a model with effects against measurements, and the fit that minimises them. Begin at `choose_measure.py`.

In this order: `choose_measure` makes an error measure (`free_simulation`, `windows`, or `predicted_force` of `forces`)
by the rule of `error_measure_rule`; `error_measure` is their protocol, `whitened_measure` the form for clean
recordings. `tuning` holds the free parameters of the model, `hypothesis` (`law_hypothesis`) those of added effects;
`output_error` fits both by least squares, `evidence_from_residuals` converts its residuals to a missing force.
`fit_score` and `standard_errors` give errors and standard errors. For impacts, `band_power` and `band_power_fit` take
the place of measure and fit (`excited_segments` selects their data).
"""
