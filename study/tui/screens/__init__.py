"""Whole screens: each turns a view into cells and keys into a reply, without rules."""
