"""Planning a study: its size before the first participant (`simulate_power`), and who comes next (`plan_study`)."""
