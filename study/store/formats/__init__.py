"""Our file formats, one module each: layout, reading and writing. Begin at `recording_file.py`."""
