"""The rules of a sitting. Pure: events in, state and next action out."""
