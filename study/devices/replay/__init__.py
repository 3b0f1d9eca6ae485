"""A device that answers with what was once recorded: for demonstrations, and for tests of everything above a device."""
