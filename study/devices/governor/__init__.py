"""Force limits and fault detection of the safety layer, computed in every control tick of every device.

In each tick `govern` calls `plausibility` (checks of the readings) -> `feedback` (spring and damper), the stimulus,
caps (`confine`) and slew limit -> `telemetry_row`. All is compiled by numba (`compiling`), with its state in arrays
(`cells`); `governor` is the interface from Python. Used by `drive`, `safe` and the drivers. Begin at `govern.py`.
"""
