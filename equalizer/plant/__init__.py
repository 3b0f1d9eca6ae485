"""Models of the device, as values.

`mechanical_model`: masses, dampers and springs as a lab writes them down, with effects named from `effect_vocabulary`;
its text is `mechanical_model_toml`, its linear part `linear_simulation`. `identified_model`: A, B, C, D fitted to
recordings, with its `model_quality` and `model_response`. Begin at `mechanical_model.py` and `identified_model.py`.
"""
