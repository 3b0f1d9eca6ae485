"""The engine process and the pipe to it, so that slow work never blocks the screen."""
