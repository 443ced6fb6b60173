"""The command `plumbob verify`: its terminal, its files, its page."""
