"""Models of the device, as immutable values.

`mechanical_model`: masses, dampers and springs, with effects named in `effect_vocabulary`; `mechanical_model_toml`
reads and writes it as text, `linear_simulation` simulates its linear part. `identified_model`: matrices A, B, C, D
fitted to recordings; `model_quality` holds its errors, `model_response` computes its frequency response and simulates
it. Used by `effects`, `identification`, `tracking`, `analysis.diagnosis` and `study`. Begin at `mechanical_model.py` or
`identified_model.py`.
"""
