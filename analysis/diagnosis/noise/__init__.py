"""The noise of each channel.

`periods` finds what repeats; `repeat_noise` takes the noise from repeats, `quiet_noise` from stretches at rest,
`channel_noise` from above the driven band, `rounding` from the steps of a converter. Begin at `noise_floor.py`, which
chooses.
"""
