"""Changes of a device since an earlier recording of the same excitation: friction, gain, response, noise.

Daily check of a free device: `measure_device` (numbers from one recording) -> `compare_measurements` (compares those of
two recordings with limits); used by `study.workflows.checks`. Drift within a session, with a hand on the handle:
`probe_lines` (spectra of a probe) -> `probe_drift` (compares them); used by `study.workflows.results.session_drift`.
Begin at `compare_measurements.py`.
"""
