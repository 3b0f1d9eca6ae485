"""Use cases: plain functions over ports, from a whole sitting to one file's validation."""
