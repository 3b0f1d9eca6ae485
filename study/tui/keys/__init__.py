"""Keys: `key_presses` (which events are presses) -> `keys_in_order` (one after the other); names and answers."""
