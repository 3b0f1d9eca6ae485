"""From what is wanted at the handle to what is commanded."""
