"""Planning a study before its first participant. Begin at `simulate_power.py`."""
