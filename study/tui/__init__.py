"""What a person sees. Screens own no rules: they turn views into words and keys into replies."""
