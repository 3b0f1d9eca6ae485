"""Three frequency bands with a method each: rigid model below, identified model, one degree of freedom above.

`rigid_model`, `low_band`, `high_band` and `stylus` are the parts; `banded_equalizer` joins them for one model,
`narrow_and_wide_models` for a narrow and a wide model of one place. Begin at `banded_equalizer.py`.
"""
