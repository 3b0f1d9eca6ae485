"""A device that replays a recording: for demonstrations, and for tests of everything above a device."""
