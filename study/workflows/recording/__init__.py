"""Recordings: made on the device, imported from other programs, inspected before any model.

A protocol -> `play_pieces` -> `take_facts` -> `record_device` -> one recording file; `import_recording` makes the same
file from foreign tables; `look_at_recordings` draws it. Begin at `record_device.py`.
"""
