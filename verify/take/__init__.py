"""What a program takes: restrictions, constants, precision, zeros, and kept state."""
