"""The drawing of the house is what the imports say now."""

import draw_architecture as draw


def test_the_committed_drawing_is_what_the_imports_say():
    assert draw.DRAWING.read_text(encoding="utf-8") == draw.drawing(), "run `make drawing`"


def test_every_package_and_module_of_a_room_has_a_box():
    for room in draw.ROOMS:
        folder = draw.folder(room)
        parents = [path.parent for path in folder.glob("*/__init__.py")]
        packages = {parent.name for parent in parents if not parent.is_symlink()} - {*draw.GROUND}
        files = {path.stem for path in folder.glob("*.py")} - {"__init__", "__main__"}
        drawn = {name.split("/")[1] for name in draw.graph(room)} - {"__main__"}
        assert drawn >= packages | files
