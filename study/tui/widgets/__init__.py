"""Parts of screens: each turns values into cells, without rules."""
