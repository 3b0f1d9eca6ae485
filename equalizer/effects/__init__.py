"""Physical effects that a simulation may leave out, one per file, and the simulator that plays them."""
