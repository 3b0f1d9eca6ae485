"""Expressions of a map: arithmetic over arrays, and nothing else.

`budget` (what they may cost) and `functions` -> `expression` (parsed and computed) -> `namespace` (what names mean).
Begin at `expression.py`.
"""
