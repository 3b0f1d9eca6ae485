"""An accelerometer with a clock of its own.

A board (`serial_reader` by `parser`) or a data-acquisition device (`sources`) gives `samples`; a thread (`sensor`)
keeps them (`history`); for the ticks of a recording the clock is fitted (`clock_fit`) and they are put where they
belong (`placement`). Begin at `sensor.py`.
"""
