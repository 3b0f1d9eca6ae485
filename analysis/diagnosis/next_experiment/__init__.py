"""Which recording would tell more.

`experiment_menu` lists what could be driven, `choose_experiment` foresees what each would part, `proposed_experiment`
says it.
"""
