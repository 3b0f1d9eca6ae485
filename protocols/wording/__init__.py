"""Every text that a participant reads: the English texts, and their replacement by those of a protocol's language.

`english_screens`, `english_help`, `english_forms` and `english_facts` contain the English texts by key -> `english`
merges them -> `translation` checks a table of translations such as `de.toml` and inserts it into the values of a
protocol -> `words` looks up the text to show. Used by `study.tui` and `study.session.views.forms`. Begin at `words.py`.
"""
