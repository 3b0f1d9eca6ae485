"""The format of a diagnosis: what is missing in a model, and how sure that is."""
