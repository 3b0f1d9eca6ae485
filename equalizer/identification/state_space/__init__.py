"""State-space models of measured frequency responses.

Order of the data: `weighted_lines` (data) -> `warped_subspace`, `canonical_variate` (starting models) -> `refinement`
(maximum likelihood) -> `candidates` (choice) -> `relaxed_poles`, `free_decay` (long decays) -> `bootstrap`
(uncertainty) -> `misfit`, `held_out_validation`. `order_report` compares orders; `refusals` holds the conditions
under which no model is fitted. Begin at `identify.py`.
"""
