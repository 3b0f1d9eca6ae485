"""Findings of a diagnosis and their wording.

`assemble_findings` makes the `findings` of a finished search: `error_table` (errors of the models), `examine_fits`
(localisation, `curves` of the effects, `black_box`), `named_effects` and `unconfirmed_candidates`, `unit_doubt`.
`residual_spectrum` is computed for the figures. `candidates` adds the results of force balances, `contrast_findings`
those of a comparison with clean recordings. `wording` puts the findings into sentences, by `candidate_wording`,
`error_wording` (held-out errors), `impact_wording`, `plausibility` and `retuned_parameters`. Used by `diagnose`,
`analysis.reports`, `analysis.figures` and `study.workflows.diagnosis`. Begin at `assemble_findings.py`.
"""
