"""Published tables measured again in their own set-up."""
