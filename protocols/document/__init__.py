"""Protocols as text: parsed with all problems listed, serialised, explained field by field, hashed and locked.

TOML text -> `loading` (with `schema`, `validation_messages`) -> a protocol -> `dumping` (TOML text), `explain` (list of
all fields); `hashing` (identifies the settings) -> `lock` (hash stored before data are collected). Used by
`study.store.formats` and `study.workflows`. Begin at `loading.py`.
"""
