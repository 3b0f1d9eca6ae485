"""Character graphics: `braille` is the canvas; directions, staircases and recordings are drawn on it."""
