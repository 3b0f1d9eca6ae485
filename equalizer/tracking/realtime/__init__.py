"""What a real-time loop of others needs of a model: all that is computed once, and values to check a translation by."""
