"""Compare the reference with physics engines and closed forms, claim by claim."""
