"""Generator of the concealed cases: simulated devices whose given model lacks some of their physics. It shares no
equations with the diagnosis.

`case_settings` (size of a case) -> `bench`, `device` (the true physics, with `effects` built in and `nuisance_effects`
that every device has; the `*_kernel` files integrate it) -> `drive_plan` (excitation) -> `sensor` -> `nominal_models`
(the model that a laboratory would have) -> `draw_case`, `draw_bank`. Additional: `laws`, `controls`, `injection`
(faults in real recordings) and `second_engine` (MuJoCo). Begin at `draw_case.py`."""
