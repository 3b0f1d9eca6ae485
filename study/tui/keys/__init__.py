"""Keys: `key_presses` (which events are presses) -> `input_queue` (serialised handling); names and answer keys."""
