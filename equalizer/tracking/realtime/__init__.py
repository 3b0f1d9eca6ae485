"""Export of a tracker for real-time loops in other languages: precomputed arrays, and cases to verify a translation."""
