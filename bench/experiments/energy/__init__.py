"""The energy of a swinging cloth under six integrators."""
