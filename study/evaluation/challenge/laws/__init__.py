"""Laws outside the catalogue, built into devices of the challenge: `hidden_laws` (which), `draw_law` (a bank)."""
