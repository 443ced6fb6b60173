"""A table takes its texts from the file beside its module, and its columns from Python."""

import pytest

from plumbob.bench.tables.captions import Captions
from plumbob.bench.tables.results import Results
from plumbob.bench.tables.table import Column

TEXTS = """
[sweeps]
question = "How many sweeps?"
title = "Sweeps"
shows = "The sweeps of {solver}."
measured = "Tolerance {tolerance} m."
"""


@pytest.fixture
def captions(tmp_path):
    (tmp_path / "chain.toml").write_text(TEXTS)
    return Captions(str(tmp_path / "chain.py"), solver="CCD")


def chain_records(results):
    return results.all("ik", task="chain")


def test_columns_of_records_are_declared_where_their_cells_are_made(make, captions):
    columns = (
        Column("stratum", words=True, read=lambda record: record.values.stratum),
        Column("residual, largest", unit="m", read=lambda record: record.values.residual.max()),
    )
    table = captions.layout("sweeps", chain_records, columns=columns)(
        Results([make.reached("near", "ccd")])
    )
    assert table.rows == (("near", 1e-5),)
    assert table.shows == "The sweeps of CCD."
    assert table.measured == "Tolerance 1.0e-4 m."


def test_a_misspelt_name_is_an_error(make, captions):
    columns = (Column("residual", read=lambda record: record.values.residuals.max()),)
    table = captions.layout("sweeps", chain_records, columns=columns)
    with pytest.raises(AttributeError, match="residuals"):
        table(Results([make.reached("near", "ccd")]))
