"""What a text file may be, and what is refused before it is read."""

import pytest

from plumbob.reference.formats.source import read_text


@pytest.fixture
def write(tmp_path):
    """Return the function that writes bytes to a file and returns its path."""

    def written(data):
        path = tmp_path / "given.txt"
        path.write_bytes(data)
        return path

    return written


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", ""),
        (b"a\nb\n", "a\nb\n"),
        (b"a\r\nb\rc", "a\nb\nc"),
        (b"\xef\xbb\xbfa", "a"),
        ("Gelenk für Füße".encode(), "Gelenk für Füße"),
    ],
)
def test_text_is_read_with_plain_line_ends(write, data, text):
    path = write(data)
    assert read_text(path) == text
    assert read_text(str(path)) == text


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"ab\0c", "NUL byte at offset 2"),
        (b"ab\xffc", "UTF-8, got byte 0xff at offset 2"),
        ("für".encode("latin-1"), "UTF-8, got byte 0xfc at offset 1"),
        ("a".encode("utf-16"), "NUL byte"),
        (b"a" * 11, "at most 10 bytes, got more"),
    ],
)
def test_what_is_no_text_is_refused(write, data, message):
    path = write(data)
    with pytest.raises(ValueError, match=message) as error:
        read_text(path, largest=10)
    assert str(error.value).startswith(str(path))


def test_what_is_no_file_is_refused(tmp_path):
    with pytest.raises(ValueError, match="nothing: there is no such file"):
        read_text(tmp_path / "nothing")
    with pytest.raises(ValueError, match="expected a regular file"):
        read_text(tmp_path)
    with pytest.raises(ValueError, match=r"^path: expected a path, got 3"):
        read_text(3)
    with pytest.raises(ValueError, match="name too long"):
        read_text("a" * 5000)
    with pytest.raises(ValueError, match="path: expected a path"):
        read_text("a\0b")
