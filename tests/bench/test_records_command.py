"""Records are listed, merged and dropped, and by nothing else."""

from dataclasses import replace

import pytest

from plumbob.bench.measure.folder_lock import locked
from plumbob.bench.measure.record import RecordFile, encode
from plumbob.cli import main as cli


@pytest.fixture
def here(tmp_path, monkeypatch, make):
    """A laptop's records and a desktop's: two of each in common."""
    monkeypatch.chdir(tmp_path)
    early, late = "2000-01-01T00:00:00+00:00", "2000-01-02T00:00:00+00:00"
    made = [make.drawn(solver, False, 1.0) for solver in ("a", "b", "c", "d")]
    failed = replace(made[1], measured={"task": made[1].task, "failed": "no"}, when=late)
    RecordFile("laptop").append([replace(record, when=early) for record in made[:3]])
    machine = {**made[0].stamp["machine"], "processor": "abacus"}
    desktop = replace(made[0], when=late, stamp={**made[0].stamp, "machine": machine})
    RecordFile("desktop").append([desktop, failed, replace(made[3], when=late)])
    return tmp_path


def plumbob(capsys, *arguments):
    code = cli.run_command(["records", *arguments])
    return code, *capsys.readouterr()


def read(folder):
    return {record.solver: record for record in RecordFile(folder).read().records}


def test_without_a_command_the_records_in_report_are_listed(capsys, here):
    (here / "laptop").rename("report")
    assert plumbob(capsys) == plumbob(capsys, "list", "report")
    assert "3 records" in plumbob(capsys)[1]


@pytest.mark.parametrize("order", [("laptop", "desktop"), ("desktop", "laptop")])
def test_merged_records_are_the_later_ones_and_none_that_failed_before_one_that_did_not(
    capsys, here, order
):
    code, out, err = plumbob(capsys, "merge", *order, "--into", "both")
    assert (code, err) == (0, "")
    assert out.startswith("4 added to both, 0 of them in place of earlier ones; 2 left")
    assert (
        "both now holds times of 2 machines: a <b>slide</b> rule, 1 core, 0.5 GiB, x; abacus" in out
    )
    both = read("both")
    assert encode(both["a"]) == encode(read("desktop")["a"])
    assert encode(both["b"]) == encode(read("laptop")["b"])
    assert set(both) == {"a", "b", "c", "d"}
    whole = RecordFile("both").path.read_bytes()
    assert plumbob(capsys, "merge", *order, "--into", "both")[1].startswith("0 added")
    assert RecordFile("both").path.read_bytes() == whole


def test_counts_of_records_have_separators_of_thousands(capsys, here, make):
    record = make.drawn("a", False, 1.0)
    RecordFile("many").append([replace(record, problem=f"p{i}") for i in range(1001)])
    assert plumbob(capsys, "merge", "many", "--into", "all")[1].startswith("1,001 added to all")
    assert plumbob(capsys, "drop", "all", "--solver", "a")[1] == "1,001 dropped from all\n"


def test_only_what_fits_all_that_is_given_is_dropped(capsys, here):
    assert plumbob(capsys, "drop", "laptop", "--solver", "a", "--dry-run")[1] == (
        "1 would be dropped from laptop\n"
    )
    assert len(read("laptop")) == 3
    assert plumbob(capsys, "drop", "laptop", "--solver", "a", "--failed")[1].startswith("0 dropped")
    assert plumbob(capsys, "drop", "laptop", "--solver", "a")[1] == "1 dropped from laptop\n"
    assert set(read("laptop")) == {"b", "c"}
    assert plumbob(capsys, "drop", "desktop", "--failed")[1] == "1 dropped from desktop\n"
    assert set(read("desktop")) == {"a", "d"}


MISUSE = {
    "nothing to drop by": (["drop", "laptop"], "drop: expected --suite, --solver"),
    "no records": (["list", "nowhere"], "no records in nowhere"),
    "nowhere to": (["merge", "laptop"], "--into"),
    "no command": (["keep"], "keep"),
}


@pytest.mark.parametrize(("arguments", "sentence"), MISUSE.values(), ids=MISUSE)
def test_misuse_of_records_exits_2_with_one_sentence(capsys, here, arguments, sentence):
    code, out, err = plumbob(capsys, *arguments)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert sentence in err


@pytest.mark.parametrize("arguments", [["drop", "--solver", "a", "laptop"],
                                       ["merge", "desktop", "--into", "laptop"]])  # fmt: skip
def test_a_folder_that_a_run_writes_to_is_left_to_it(capsys, here, arguments):
    with locked("laptop"):
        code, _, err = plumbob(capsys, *arguments)
    assert code == 2
    assert "expected a folder that nobody writes to" in err
    assert set(read("laptop")) == {"a", "b", "c"}
