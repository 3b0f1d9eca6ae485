"""Whether installation, computer and device are fit for a study.

`check_installation`, `check_device`, `check_timing` and `computer_load` each answer one question; `examine_setup` asks
all of them (`hapteq doctor`). Begin at `examine_setup.py`.
"""
