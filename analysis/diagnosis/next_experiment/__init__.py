"""Optimal design of the next experiment: which recording would tell rivals apart.

`experiment_menu` lists what could be driven, `choose_experiment` foresees what each would part, `propose_experiment`
says it.
"""
