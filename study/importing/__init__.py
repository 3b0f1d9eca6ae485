"""Recordings of other laboratories, by way of a map that says which array is what, as recordings of ours."""
