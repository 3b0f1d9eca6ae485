"""Expressions of a map: arithmetic over arrays, and nothing else.

`budget` (limit of the cost) and `functions` -> `expression` (parsed and evaluated) -> `namespace` (meaning of names).
Begin at `expression.py`.
"""
