"""Is the reference right? Engines beside it, claim by claim."""
