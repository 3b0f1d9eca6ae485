"""Coverage of intervals near the cap: counted by simulation (`measured_coverage`), then in words (`coverage_words`)."""
