"""State-space models of measured frequency responses.

`weighted_lines` -> starts (`warped_subspace`, `canonical_variate`) -> `refinement` (maximum likelihood) ->
`candidates` (the choice) -> `relaxed_poles`, `settled_recordings` (long decays) -> `bootstrap` (uncertainty) ->
`held_out`, `misfit`.
`order_report` compares orders; `refusals` state when no model is made. Begin at `identify.py`.
"""
