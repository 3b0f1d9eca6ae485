"""The command line: one file per command, light to import."""
