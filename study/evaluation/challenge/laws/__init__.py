"""Laws outside the catalogue, built into devices of the challenge: `concealed_laws` (which), `draw_law` (a bank)."""
