"""One figure per file: takes values, returns a Matplotlib Figure. Nothing is written here."""
