"""How far a model with effects is from what was measured, and the fit that makes that distance small.

In this order: `choose_measure` makes one of the error measures (`free_simulation`, `windows`, `predicted_force` of
`forces`; `band_power` for impacts, `coloured_measure` beside clean recordings) behind `error_measure`, which
`measure_rule` picks; `tuning` holds the model's own open numbers and `hypothesis` those of added effects;
`output_error` fits both by least squares and says what motion the fit leaves unexplained (`unexplained_motion`);
`fit_score` and `intervals` say how good the fit is.
"""
