"""Accelerometer on a board or data-acquisition device with its own clock, aligned to the loop's ticks.

A board (`serial_reader` by `parser`) or a data-acquisition device (`sources`) gives `samples`; a thread (`sensor`)
keeps them (`history`); for the ticks of a recording the clock is fitted (`clock_fit`) and they are put where they
belong (`placement`). Begin at `sensor.py`.
"""
