"""Coverage of a report's intervals near the cap: counted by simulation (`measured_coverage`), said (`coverage_words`)."""
