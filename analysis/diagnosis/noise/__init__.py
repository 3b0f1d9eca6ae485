"""Noise of each channel of a recording (rms and spectral density), against which the errors of a model are compared.

`noise_floor` takes the first estimate that the data allow: `repeat_noise` (differences between repeated `periods`;
`rounding` corrects for quantization), or `quiet_noise` (samples at rest, then spectral lines above the driven band).
The result is a `channel_noise` for each signal. Used by `forces`, `errors`, `localisation` and `analysis.look`. Begin
at `noise_floor.py`.
"""
