"""State-space models of measured frequency responses, by subspace identification and maximum likelihood.

`identify_recordings` estimates the response (`free_decay`: slow decays subtracted) and calls `identify` (options:
`settings`): `weighted_lines` (data) -> `warped_subspace`, `canonical_variate` (starting models) -> `refinement`
(maximum likelihood, in the `modal_form`) -> `candidates` (choice) -> `relaxed_poles` (long decays; else bounded by
`stable_poles`) -> `bootstrap` (uncertainty) -> `misfit`, `misfit_causes` (by `held_out_validation`). `order_report`
compares orders; `refusals` holds the conditions under which no model is fitted. Used by `study.workflows.equalizer`
(`hapteq identify`). Begin at `identify_recordings.py`, then `identify.py`.
"""
