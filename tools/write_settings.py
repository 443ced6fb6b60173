"""Write the tables of the search into the pages of docs/peers, between their marks.

    python tools/write_settings.py

A page has `<!-- search: SOLVER -->` and `<!-- end -->`, or `all solvers` for the table of all. No
figure of the search is typed by hand: `tests/bench/test_tuning.py` compares the pages with it.
"""

import itertools
import json
import re
from pathlib import Path

import search_settings as tuning

from plumbob.bench.measure import metrics
from plumbob.bench.problems.robots import TUNING, title

FOLDER = Path(__file__).parents[1] / "docs" / "peers"
MARK = re.compile(r"(<!-- search: (.*?) -->\n).*?(<!-- end -->)", re.DOTALL)
ALL = "all solvers"


def percent(share):
    """A share in percent."""
    return f"{100 * share:.1f}"


def interval(solved):
    """A share in percent with its interval."""
    share = metrics.share(solved.ravel())
    return f"{percent(share.hits / share.total)} ({percent(share.low)}–{percent(share.high)})"


def value_text(value):
    """A value of a setting as text."""
    return json.dumps(value) if isinstance(value, bool) else value or repr(value)


def written(settings):
    """Settings as text; `bench_restarts` are restarts by the bench."""
    return ", ".join(f"`{name}` {value_text(value)}" for name, value in settings.items())


def table(head, rows):
    """A table in Markdown; columns of percentages, counts and times are numbers, to the right."""
    rule = ["---:" if name.endswith(("%", "tried", "µs")) else "---" for name in head]
    return "\n".join(f"| {' | '.join(map(str, cells))} |" for cells in (head, rule, *rows)) + "\n"


class Results:
    """The trials of a search."""

    def __init__(self, search, trials):
        self.search = search
        self.screened = search.own(trials, tuning.SCREENED)
        self.default, self.bench = map(self.of, (search.candidates[0], search.bench))
        self.chosen = tuning.best_trial(search, trials)

    def of(self, settings):
        """The trial of these settings."""
        return next(trial for trial in self.screened if trial.settings == settings)

    def overview(self):
        """The row of the table of all solvers."""
        shares = [percent(trial.share) for trial in (self.default, self.bench)]
        chosen = [interval(self.chosen.solved), f"{self.chosen.microseconds:.0f}"]
        names = [self.search.solver, self.search.kind, len(self.search.candidates)]
        return [*names, *shares, *chosen, written(self.chosen.settings)]

    def roles(self):
        """The three settings of interest; equal ones share a row."""
        roles = {}
        for role, trial in (
            ("authors’ defaults", self.default),
            ("bench", self.bench),
            ("chosen", self.chosen),
        ):
            roles.setdefault(json.dumps(trial.settings), ([], trial))[0].append(role)
        for names, trial in roles.values():
            shares = [percent(share) for share in (*trial.solved.mean(axis=1), trial.share)]
            yield [self.search.kind, ", ".join(names), written(trial.settings), *shares]

    def best_share(self, name, value):
        """The best share on the first targets with a value of a setting, "" if not tried."""
        trials = [trial for trial in self.screened if trial.settings.get(name) == value]
        shares = [trial.screened_share for trial in trials]
        return percent(max(shares)) if shares else ""


def page(results):
    """The tables of a solver's page, from its searches."""
    head = ["", "settings", "values", *(f"{title(name)} %" for name in TUNING), "all %"]
    roles = table(head, [row for result in results for row in result.roles()])
    rows, candidates = [], [settings for r in results for settings in r.search.candidates]
    for name in dict.fromkeys(itertools.chain(*candidates)):
        values = dict.fromkeys(settings[name] for settings in candidates if name in settings)
        for value in values if len(values) > 1 else ():
            cells = [result.best_share(name, value) for result in results]
            rows.append([f"`{name}`", value_text(value), *cells])
    head = ["setting", "value", *(f"{result.search.kind} %" for result in results)]
    text = f"Best share with each value, on the first {tuning.SCREENED} targets of each robot:\n"
    return "\n".join([roles, text, table(head, rows)])


def contents():
    """The text between the marks, by solver."""
    trials = tuning.read(tuning.RESULTS)
    results = [Results(search, trials) for search in tuning.searches()]
    head = ["solver", "", "tried", "defaults %", "bench %", "chosen, with 95 % interval, %", "µs"]
    rows = [result.overview() for result in results]
    solvers = itertools.groupby(results, lambda result: result.search.solver)
    parts = {solver: page(list(own_results)) for solver, own_results in solvers}
    return {ALL: table([*head, "chosen settings"], rows), **parts}


def filled(text, parts):
    """A page with the text between its marks."""
    return MARK.sub(lambda match: f"{match[1]}\n{parts[match[2]]}\n{match[3]}", text)


def main():
    """Fill all pages of the folder."""
    parts = contents()
    for path in sorted(FOLDER.glob("*.md")):
        path.write_text(filled(path.read_text(encoding="utf-8"), parts), encoding="utf-8")


if __name__ == "__main__":
    main()
