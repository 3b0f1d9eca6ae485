"""Identify and validate any file, and generate the documentation of the formats from the code.

`file_content` (opened once) -> `recognisers`, `session_recognisers` (one small function per format) -> `validate`,
`validate_apart` (in a separate process), `validate_together`. `format_docs` and the `*_docs` write docs/. Begin at
`validate.py`.
"""
