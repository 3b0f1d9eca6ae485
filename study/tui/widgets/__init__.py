"""Parts of screens: each turns values into cells and knows no rules."""
