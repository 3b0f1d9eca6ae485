"""Files: the log, session folders, recordings, models, tables, documents. Whole or not at all, nothing overwritten."""
