"""A simulated omega.3 in its own equations. It shares no code with the models that are fitted to it, or diagnosis
would only recognise its own work. No replication: see docs/simulated_omega3.md."""
