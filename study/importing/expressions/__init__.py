"""Expressions of an import map: arithmetic over arrays, without access to files or other Python code.

`budget` (limit of the cost) and `functions` -> `expression` (parsed and evaluated) -> `namespace` (meaning of names).
Used by `study.importing.build_recording` and `study.importing.part_signals`. Begin at `expression.py`.
"""
