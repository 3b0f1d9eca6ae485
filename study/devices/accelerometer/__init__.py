"""An accelerometer on a microcontroller, read over a serial line: packets, parser, clock, calibration, reader."""
