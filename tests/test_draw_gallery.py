"""The gallery of the documentation: faulty solvers beside right ones."""

import numpy as np
import pytest
from PIL import Image

NAMES = ["curves.svg", "cloths.svg", "missing_parent.gif", "explicit_euler.gif"]


@pytest.fixture
def draw_gallery():
    """Return the program, whose imports take long."""
    import draw_gallery

    assert list(draw_gallery.PICTURES) == NAMES
    return draw_gallery


@pytest.mark.sample("explicit_euler")
@pytest.mark.parametrize("name", NAMES)
def test_a_famous_fault_shows_beside_the_right_solver(draw_gallery, name, monkeypatch):
    monkeypatch.setattr("plumbob.bench.show.scenes.FRAMES", 20)
    solver, faults = draw_gallery.PICTURES[name]
    *wrong, right = draw_gallery.beside_truth(solver, faults).motions
    assert [motion.label for motion in wrong] == [fault.title for fault in faults]
    assert all(np.max(motion.errors[2:]) > 1e-3 for motion in wrong)
    assert right.errors[-1] < 1e-3


@pytest.mark.slow
def test_the_gallery_has_pictures_and_films(draw_gallery, tmp_path, monkeypatch):
    monkeypatch.setattr("plumbob.bench.show.scenes.FRAMES", 12)
    names = ["cloths.svg", "explicit_euler.gif"]
    pictures = {name: draw_gallery.PICTURES[name] for name in names}
    monkeypatch.setattr(draw_gallery, "PICTURES", pictures)
    draw_gallery.draw_gallery(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == names
    assert "Gravity twice" in (tmp_path / names[0]).read_text(encoding="utf-8")
    with Image.open(tmp_path / names[1]) as film:
        assert film.width > 1.7 * film.height
        assert film.n_frames == 5
        first = film.convert("RGB").tobytes()
        film.seek(film.n_frames - 1)
        assert film.convert("RGB").tobytes() != first
