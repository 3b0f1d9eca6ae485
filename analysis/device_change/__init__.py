"""What changed at a device since an earlier recording of the same excitation: friction, gain, response, noise.

`measure_device` makes numbers of one recording; `compare_devices` sets two of them side by side, with limits.
"""
