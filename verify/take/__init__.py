"""What a program takes: restrictions, constants, precision, zeros, and state that it keeps."""
