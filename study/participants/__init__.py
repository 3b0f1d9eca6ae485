"""Simulated participants. Stateless: an answer depends on the trial and the seed only, not on earlier answers."""
