"""Number of answers in words with the right form of the verb, for messages at the end of a sitting."""


def format_answer_count(answers: int) -> str:
    """Format a number of answers with its verb: "1 answer is", "0 answers are", "3 answers are"."""
    return "1 answer is" if answers == 1 else f"{answers} answers are"
