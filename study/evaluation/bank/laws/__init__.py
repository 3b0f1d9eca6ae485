"""A bank of concealed laws: `seal_laws`, `prove_laws` (answered as any bank, revealed), `write_laws`."""
