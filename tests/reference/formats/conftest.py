"""How a reader must refuse what it cannot read."""

import pytest


@pytest.fixture
def refusal():
    """Return the function that calls a reader and returns the one sentence of its refusal."""

    def call(read, *arguments, **options):
        with pytest.raises(ValueError, match="expected") as caught:
            read(*arguments, **options)
        message = str(caught.value)
        assert type(caught.value) is ValueError  # and no kind of it that Python raised by itself
        assert "\n" not in message
        assert len(message) < 400
        return message

    return call
