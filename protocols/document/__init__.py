"""Protocols as text: read with every problem named, written, explained, hashed and locked.

Text -> `loading` (`schema`, `validation_messages`) -> a protocol -> `dumping`, `explain`; `hashing` -> `lock`. Begin at
`loading.py`.
"""
