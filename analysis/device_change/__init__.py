"""Changes of a device since an earlier recording of the same excitation: friction, gain, response, noise.

For the daily check of a free device: `measure_device` computes the numbers from one recording, `compare_devices`
compares those of two recordings with limits. For short probes within a session, with a hand on the handle,
`probe_lines` computes spectra and `probe_drift` compares them. Begin at `compare_devices.py`.
"""
