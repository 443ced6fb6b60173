"""Run the command line."""

from .entry_point import main

if __name__ == "__main__":
    main()
