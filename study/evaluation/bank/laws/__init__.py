"""A bank of concealed laws (terms outside the effect catalogue): `seal_laws`, `prove_laws` (answer and reveal),
`write_law_proof`."""
