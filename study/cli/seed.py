"""The seed of a command: as large as every file of ours holds it."""

from study.errors import WrongUseError

LARGEST_BITS = 128
"""`study.store.disk.strict_json` reads whole numbers of up to 40 digits."""


def check_seed(seed: int | None) -> int | None:
    """Of an option. Raises WrongUseError."""
    if seed is not None and seed.bit_length() > LARGEST_BITS:
        raise WrongUseError(
            "This seed is too large",
            f"It has {seed.bit_length()} bits; files hold seeds of up to {LARGEST_BITS}.",
            "Give a smaller one to --seed, or none.",
        )
    return seed
