"""Equalization in three frequency bands: rigid model (low), identified model (middle), one degree of freedom (high).

Reference acceleration -> `low_band` (by `rigid_model`), middle band (by `lqr`), `high_band` (with `stylus`) ->
`banded_equalizer` (adds the forces) -> `banded_forces` (the result). `narrow_and_wide_models` does the same with a
narrow-band and a wide-band model of one place. Used by `study.workflows.equalizer`. Begin at `banded_equalizer.py`.
"""
