"""Keys: `key_presses` (which events are presses) -> `keys_in_order` (serialised handling); names and answer keys."""
