"""One file per format of ours: what it holds, its reading and its writing. Begin at `recording_file.py`."""
