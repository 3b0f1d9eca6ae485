"""Generator of blind-test cases: simulated devices with concealed physics that their nominal model lacks. It shares no
equations with the diagnosis.

`case_settings` (size of a case) -> `bench`, `device` (the true physics: a `concealed_effect` of `effects`, and
`nuisance_effects` that every device has; the `*_kernel` files integrate it) -> `drive_plan` (excitation) -> `sensor` ->
`nominal_models` (the model that a laboratory would have) -> `draw_case` -> `draw_bank`. Additional: `laws`, `controls`,
`injection` (faults in real recordings) and `second_engine` (MuJoCo). Used by `study.evaluation.bank` and
`study.evaluation.real`. Begin at `draw_case.py`.
"""
