"""Force balance along a measured motion: linear regression of the force on many candidate laws at once.

`balances` runs all steps for each axis: `motion` (positions, velocities and accelerations, in the `band` that their
noise allows; sensors of the same points are fused by `fused_motion`) -> `laws` (a folder: candidate terms) ->
`regression` (on mass, damping, stiffness, or a given model: `given_model_base`, and the laws; products in `blocks` of
samples) -> `structures` (beam search over sums of laws by `change_laws`, repeated by `linear_part` for delays and
linear dynamics) -> `judge_laws` (decides on held-out data which laws are named: `judged_law`) -> `compare_free_laws`
(replaces them by laws outside the catalogue, where these fit clearly better). `actuator` finds laws of the actuator by
an `inverse_balance`; `actuator_equivalents` withdraws names that these explain as well. Used by `diagnose`,
`first_model`, `contrast` and `confirm`. Begin at `balances.py`, then `judge_laws.py`.
"""
