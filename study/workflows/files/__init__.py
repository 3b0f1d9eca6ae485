"""What any file is and whether it is whole, and the documentation of the formats made from the code.

`file_content` (opened once) -> `recognisers`, `session_recognisers` (one small function per format) -> `validate`,
`validate_apart` (a process of its own), `validate_together`. `format_docs` and the `*_docs` write docs/.
Begin at `validate.py`.
"""
