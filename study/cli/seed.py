"""Check of the option `--seed` of the commands: the seed must fit into the integers that hapteq's files can hold."""

from study.errors import WrongUseError

MAX_SEED_BITS = 128
"""Largest seed in bits: 128 bits are up to 39 digits, and `study.store.disk.strict_json` reads up to 40."""


def check_seed(seed: int | None) -> int | None:
    """Return the seed unchanged (typer callback). Raises WrongUseError if it has more than `MAX_SEED_BITS` bits."""
    if seed is not None and seed.bit_length() > MAX_SEED_BITS:
        raise WrongUseError(
            "This seed is too large",
            f"It has {seed.bit_length()} bits; files hold seeds of up to {MAX_SEED_BITS}.",
            "Give a smaller one to --seed, or none.",
        )
    return seed
