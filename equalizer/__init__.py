"""What the device is and how to drive it. Pure: values in, values out; knows neither protocols nor sessions.

Read in this order: `signals.signal` and `signals.recording` (the two values everything is about), `signals.lockin`,
`plant` (models of the device, the vocabulary of effects), `tracking.equalizer` (the port a stimulus passes through).
"""
