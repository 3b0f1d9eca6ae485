"""A laboratory's own blind test of the diagnosis: `lab_kit` draws and seals a table of changes, `score_kit` scores
the answers."""
