"""Accelerometer on a board or data-acquisition device with its own clock, resampled to the control loop's ticks.

`sources` opens a board (`serial_reader`, `parser`) or a data-acquisition device, which gives `samples`; `sensor` keeps
them (`history`, `newest_sample`). After a recording the sensor's clock is fitted to the computer's (`clock_fit`) and
the samples are resampled to the ticks (`tick_resampling`). `six_positions` and `calibration` calibrate the sensor under
gravity; `sensor_findings` are the checks of `hapteq doctor`. Used by `force_dimension` and `opening`. Begin at
`sensor.py`.
"""
