"""Laws outside the catalogue of effects, concealed in simulated devices of the challenge.

`concealed_laws` (table of the laws) -> `build_law` (builds one into a device) -> `draw_law` (draws the cases of a
bank). Used by `study.evaluation.bank.laws.seal_laws`. Begin at `concealed_laws.py`.
"""
