"""Optimal design of the next experiment: which recording would discriminate between rival explanations.

`experiment_menu` (possible experiments, as commands to simulate) -> `choose_experiment` (predicts how well each
discriminates) -> `propose_experiment` (runs both and returns the proposal). Used by `result.assemble_findings`, and by
`study.evaluation.bank.follow_up`. Begin at `propose_experiment.py`.
"""
