"""Errors of a model with effects against measurements, and the fit that minimises them.

In this order: `choose_measure` makes one of the error measures (`free_simulation`, `windows`, `predicted_force` of
`forces`; `band_power` for impacts, `whitened_measure` with clean recordings), selected by `error_measure_rule`;
`error_measure` is their protocol; `tuning` has the free parameters of the model, `hypothesis` those of added effects;
`output_error` fits both by least squares and converts its residual to a missing force (`evidence_from_residuals`);
`fit_score` and `intervals` say how good the fit is.
"""
