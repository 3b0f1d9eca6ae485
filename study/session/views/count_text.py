"""Numbers with a noun in the form that agrees with them, for messages."""


def format_count(number: int, noun: str) -> str:
    """Format a number with its noun, in the plural unless the number is 1."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def format_answer_count(answer_count: int) -> str:
    """Format a number of answers with its verb: "1 answer is", "0 answers are", "3 answers are"."""
    return "1 answer is" if answer_count == 1 else f"{answer_count} answers are"
