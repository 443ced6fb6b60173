"""What `plumbob bench SUITE` prints: the tables that its records make, and no others."""

from bench import terminal
from bench.harness.record import RecordFile


def test_the_tables_of_the_suites_asked_for_are_printed(capsys, tmp_path, records):
    RecordFile(tmp_path).append(records)
    terminal.print_tables(["ik"], tmp_path)
    out = capsys.readouterr().out
    assert "Robots, restarts: success, time and accuracy" in out
    assert "Plumbob LM" in out
    assert "2/4 = 50 %" in out
    assert "Claims held" not in out


def test_brackets_are_units_and_no_markup(capsys, tmp_path, records):
    RecordFile(tmp_path).append(records)
    terminal.print_tables(["check"], tmp_path)
    terminal.print_tables(["timing"], tmp_path)
    assert "[ns]" in capsys.readouterr().out


def test_tables_without_rows_are_not_printed(capsys, tmp_path):
    RecordFile(tmp_path).append([])
    terminal.print_tables(["ik"], tmp_path)
    assert capsys.readouterr().out == ""
