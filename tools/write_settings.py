"""Write the tables of the search into the pages of docs/peers, between their marks.

    python tools/write_settings.py

A page has `<!-- search: SOLVER -->` and `<!-- end -->`, or `all solvers` for the table of all. No
figure of the search is typed by hand: `tests/bench/test_tuning.py` compares the pages with it.
"""

import json
import re
from pathlib import Path

import numpy as np
import search_settings as tuning

from plumbob.bench.harness import metrics
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


def written(settings):
    """Settings as text; `bench_restarts` are restarts by the bench."""
    return ", ".join(
        f"`{name}` {json.dumps(value) if isinstance(value, bool) else value or repr(value)}"
        for name, value in settings.items()
    )


def table(head, rows):
    """A table in Markdown; columns after the first texts are numbers, to the right."""
    rule = ["---:" if name.endswith(("%", "tried")) else "---" for name in head]
    return "\n".join(f"| {' | '.join(map(str, cells))} |" for cells in (head, rule, *rows)) + "\n"


class Results:
    """The trials of a search."""

    def __init__(self, search, trials):
        self.search = search
        self.screened = tuning.trials_of(search, trials, tuning.SCREENED)
        self.trials = tuning.trials_of(search, trials, tuning.COUNT)
        self.default = self.full(search.default)
        self.before = self.full(search.before)
        self.chosen = tuning.best_trial(search, self.trials)

    def full(self, settings):
        """The trial of these settings on all targets."""
        return next(trial for trial in self.trials if trial.settings == settings)

    def overview(self):
        """The row of the table of all solvers."""
        shares = [percent(trial.share) for trial in (self.default, self.before)]
        chosen = [interval(self.chosen.solved), written(self.chosen.settings)]
        return [self.search.solver, self.search.start, len(self.search.settings), *shares, *chosen]

    def roles(self):
        """The three settings of interest; equal ones share a row."""
        roles = {}
        for role, trial in (
            ("authors’ defaults", self.default),
            ("before", self.before),
            ("chosen", self.chosen),
        ):
            roles.setdefault(json.dumps(trial.settings), ([], trial))[0].append(role)
        for names, trial in roles.values():
            robots = [percent(share) for share in trial.solved.mean(axis=1)]
            yield [", ".join(names), written(trial.settings), *robots, percent(trial.share)]

    def values(self):
        """The best share of each value of each setting, on the targets that all were tried on."""
        for name in self.search.default:
            trials = [trial for trial in self.screened if name in trial.settings]
            values = list(dict.fromkeys(trial.settings[name] for trial in trials))
            for value in values if len(values) > 1 else ():
                shares = [trial.share for trial in trials if trial.settings[name] == value]
                cells = [f"`{name}`", written({name: value}).split(" ", 1)[1], len(shares)]
                yield [*cells, percent(np.max(shares)), percent(np.median(shares))]

    def page(self):
        """The tables of a solver's page."""
        robots = [f"{title(name)} %" for name in TUNING]
        head = ["settings", "values", *robots, "all %"]
        trials = f"{self.search.start}: {len(self.search.settings)} settings tried"
        count = f"On the first {tuning.SCREENED} targets of each robot:"
        by_value = table(["setting", "value", "tried", "best %", "median %"], self.values())
        return "\n".join([f"**{trials}**\n", table(head, self.roles()), count + "\n", by_value])


def contents():
    """The text between the marks, by solver."""
    trials = tuning.read(tuning.RESULTS)
    results = [Results(search, trials) for search in tuning.searches()]
    head = ["solver", "", "tried", "defaults %", "before %", "chosen, with 95 % interval, %"]
    parts = {ALL: table([*head, "chosen settings"], [result.overview() for result in results])}
    for result in results:
        name = result.search.solver
        parts[name] = "\n".join(filter(None, (parts.get(name), result.page())))
    return parts


def filled(text, parts):
    """A page with the text between its marks."""
    return MARK.sub(lambda match: f"{match[1]}\n{parts[match[2]]}\n{match[3]}", text)


def main():
    """Fill all pages of the folder."""
    parts = contents()
    for page in sorted(FOLDER.glob("*.md")):
        page.write_text(filled(page.read_text(encoding="utf-8"), parts), encoding="utf-8")


if __name__ == "__main__":
    main()
