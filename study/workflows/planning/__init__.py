"""Planning a study: its size before the first participant (`simulate_power`). Who comes next: `views.plan_study`."""
