"""Export of a model's real-time controller as C sources, for control loops in C and C++.

`export_controller` (`hapteq export-controller`) calls `c_source`, which inserts sizes and tables of numbers into the
templates of this folder. Used by `study.cli.export_controller`. Begin at `export_controller.py`.
"""
