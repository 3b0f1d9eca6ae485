"""The plain values of a diagnosis of a real recording: `make_real_answer` makes a `real_answer`."""
