"""Simulated participants. Stateless: what they answer depends on the trial and the seed, never on what came before."""
