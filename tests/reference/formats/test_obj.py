"""What OBJ files say, and which of them are refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plumbob.reference.formats import parse_obj, read_obj

CORNERS = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def triangles(faces, vertices=CORNERS):
    return parse_obj(vertices + faces).triangles.tolist()


def read_or_refused(text):
    """Return whether a text is read, into a sound mesh; else it is refused by a ValueError."""
    try:
        mesh = parse_obj(text)
    except ValueError:
        return False
    assert np.isfinite(mesh.vertices).all()
    assert 0 <= mesh.triangles.min() <= mesh.triangles.max() < len(mesh.vertices)
    return True


class TestReading:
    def test_vertices_and_triangles_come_as_they_stand(self):
        mesh = parse_obj("v 0 0.5 -1e-3\nv 1. .25 +2E2\nv 3 4 5\nf 1 2 3\nf 3 2 1\n")
        expected = [[0, 0.5, -1e-3], [1, 0.25, 200], [3, 4, 5]]
        np.testing.assert_array_equal(mesh.vertices, expected)
        assert mesh.triangles.tolist() == [[0, 1, 2], [2, 1, 0]]
        assert mesh.vertices.dtype == np.float64
        assert mesh.triangles.dtype == np.int64

    @pytest.mark.parametrize("corner", ["{}", "{}/7", "{}//7", "{}/7/7", "{}/-1/-2", "{}/"])
    def test_textures_and_normals_are_read_over(self, corner):
        face = " ".join(corner.format(i) for i in (1, 2, 3))
        assert triangles(f"vt 0 0\nvn 0 0 1\nf {face}\n") == [[0, 1, 2]]

    def test_negative_indices_count_back_from_the_line_they_are_on(self):
        assert triangles("f -4 -3 -1\nv 2 2 2\nf -1 -3 1\n") == [[0, 1, 3], [4, 2, 0]]

    def test_positive_indices_may_come_before_their_vertices(self):
        assert parse_obj("f 1 2 3\n" + CORNERS).triangles.tolist() == [[0, 1, 2]]

    def test_polygons_become_fans(self):
        assert triangles("f 1 2 3 4\n") == [[0, 1, 2], [0, 2, 3]]
        five = triangles("v 0 0 1\nf 5 4 3 2 1\n")
        assert five == [[4, 3, 2], [4, 2, 1], [4, 1, 0]]

    def test_a_backslash_continues_a_line_but_not_a_comment(self):
        assert triangles("f 1 2 \\\n  3 \\\n4\n") == [[0, 1, 2], [0, 2, 3]]
        assert triangles("# C:\\\nf 1 2 3\n") == [[0, 1, 2]]
        assert triangles("f 1 2 \\ # and\n3 4") == [[0, 1, 2], [0, 2, 3]]
        assert triangles("f 1 2 3 \\") == [[0, 1, 2]]
        assert triangles("f 1 2 3 \\\n\nf 1 2 4") == [[0, 1, 2], [0, 1, 3]]

    def test_a_file_is_read_whatever_its_line_ends(self, tmp_path):
        path = tmp_path / "square.obj"
        path.write_bytes((CORNERS + "f 1 2 \\\n3 4\n").replace("\n", "\r\n").encode())
        assert read_obj(path).triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
        with pytest.raises(ValueError, match=r"cube.obj: there is no such file"):
            read_obj(tmp_path / "cube.obj")


class TestRefused:
    @pytest.mark.parametrize(
        ("line", "message"),
        [
            ("v 1 2", "three coordinates, got 2"),
            ("v", "three coordinates, got 0"),
            ("v 1 2 nan", "finite number, got 'nan'"),
            ("v 1 2 inf", "finite number"),
            ("v 1e999 0 0", "finite number, got '1e999'"),
            ("v 1_0 0 0", "finite number, got '1_0'"),
            ("v 1,5 0 0", "finite number"),
            ("v 0x1p3 0 0", "finite number"),
            ("v ١ 0 0", "finite number"),
            ("f 1 2", "three corners or more, got 2"),
            ("f", "three corners or more, got 0"),
            ("f 1 2 2", "different vertices, got one twice"),
            ("f 1 2 -4", "different vertices"),
            ("f 1 2 5", "vertex of the file, got 5 of 4"),
            ("f 1 2 999999999999999", "vertex of the file"),
            ("f 1 2 0", "1 or more, or -4 to -1, got 0"),
            ("f 1 2 -5", "got -5"),
            ("f 1 2 " + "9" * 5000, "v/vt, v//vn or v/vt/vn, got '999"),
            ("f 1 2 3.0", "got '3.0'"),
            ("f 1 2 3/1/1/1", "got '3/1/1/1'"),
            ("f 1 2 /3", "got '/3'"),
            ("f 1 2 3_0", "got '3_0'"),
            ("f 1 2 x", "got 'x'"),
            ("faces 12", "statement of the format, got 'faces'"),
            ("<html>", "statement of the format, got '<html>'"),
        ],
    )
    def test_a_wrong_statement_is_named_with_its_line(self, line, message):
        text = CORNERS + line + "\nf 1 2 3\n"
        with pytest.raises(ValueError, match=r"^cube, line 5: ") as error:
            parse_obj(text, name="cube")
        assert message in str(error.value)
        assert len(str(error.value)) < 150

    @pytest.mark.parametrize("text", ["", CORNERS, "# nothing\n"])
    def test_a_text_without_faces_is_refused(self, text):
        with pytest.raises(ValueError, match=r"^text: expected faces, got none"):
            parse_obj(text)

    def test_a_file_cut_off_anywhere_is_read_or_refused(self):
        text = CORNERS + "f 1//1 2//2 3//3\nf -1 -2 -4 \\\n 2\n"
        assert sum(read_or_refused(text[:end]) for end in range(len(text))) > 10

    @given(st.text(alphabet="vf0123456789-/.e \n\\#+xn", max_size=200))
    def test_random_text_is_read_or_refused(self, noise):
        read_or_refused(CORNERS + noise + "\nf 1 2 3\n")
