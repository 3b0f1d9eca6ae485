"""Identify and validate any file, and generate the documentation of the formats from the code.

`file_content` (the file, opened once) -> `recognisers`, `session_recognisers` (one function per format) -> `validate`
(one file) -> `validate_in_process` (many files, in a separate process) -> `check_model_channels` (files against each
other). `format_docs` and `importing_docs` generate pages of docs/, with the prose of `formats_text` and
`importing_text`. Used by `study.cli.validate` (`hapteq validate`) and `make docs`. Begin at `validate.py`.
"""
