"""The plain values of a diagnosis of a real recording: `answer_of_findings` makes a `real_answer`."""
