"""Optimal design of the next experiment: which recording would discriminate between rivals.

`experiment_menu` lists the possible experiments, `choose_experiment` predicts how well each discriminates,
`propose_experiment` formulates the result.
"""
