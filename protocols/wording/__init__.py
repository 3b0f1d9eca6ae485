"""Every text that a participant reads: the English ones, and how a protocol's own language replaces them.

`english_screens`, `english_help`, `english_forms`, `english_facts` -> `english` (all keys) -> `words` (what is shown);
`in_language` resolves a table such as `de.toml` into a protocol and says what is wrong with one. Begin at `words.py`.
"""
