"""The `--seed` option: limited to what all our files can hold."""

from study.errors import WrongUseError

LARGEST_BITS = 128
"""`study.store.disk.strict_json` reads integers of up to 40 digits."""


def check_seed(seed: int | None) -> int | None:
    """Option callback: the seed, unchanged. Raises WrongUseError if it is too large."""
    if seed is not None and seed.bit_length() > LARGEST_BITS:
        raise WrongUseError(
            "This seed is too large",
            f"It has {seed.bit_length()} bits; files hold seeds of up to {LARGEST_BITS}.",
            "Give a smaller one to --seed, or none.",
        )
    return seed
