"""Between the process that draws and those that work, so that nothing slow ever holds up the screen."""
