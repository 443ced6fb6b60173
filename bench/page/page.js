"use strict";
// Tables that sort, filter, choose their columns, link to a row and copy what is shown. Controls are
// made when a table is first seen. The address keeps the view: #table:row?sort=2-&columns=0.1&by1=X
// A switch for the whole page chooses the solvers with one start or with restarts.
(() => {
  const make = (tag, attributes, ...children) => {
    const element = Object.assign(document.createElement(tag), attributes);
    element.append(...children);
    return element;
  };
  const button = (onclick, ...children) => make("button", { onclick }, ...children);
  const plain = cell => {
    const copy = cell.cloneNode(true);
    copy.querySelectorAll("sup").forEach(sup => sup.prepend("e"));
    return copy.textContent.replaceAll(" · 10e", "e").replaceAll("−", "-").replace(/\s+/g, " ").trim();
  };
  const number = cell => {
    const [value, total = 1] = (cell.dataset.v ?? "NaN").split("/");
    return value / total;
  };
  const compare = (a, b, sign) => {
    const [x, y] = [number(a), number(b)];
    if (isNaN(x) && isNaN(y)) return sign * plain(a).localeCompare(plain(b), undefined, { numeric: true });
    return isNaN(x) ? 1 : isNaN(y) ? -1 : sign * (x - y);
  };
  const starts = document.querySelectorAll("[name^=starts]");
  const start = () => [...starts].find(input => input.checked)?.value;
  const listed = flags => flags.flatMap((on, j) => on ? j : []).join(".");

  class View {
    constructor(box) {
      this.box = box;
      this.table = box.querySelector("table");
      this.body = this.table.tBodies[0];
      this.rows = [...this.body.rows];
      this.groups = [...this.table.querySelectorAll(".group")];
      this.heads = [...[...this.table.tHead.rows].at(-1).cells];
      this.titles = this.heads.map(plain);
      this.usual = this.heads.map(head => !head.classList.contains("folded"));
      this.heads.forEach((head, j) => ["words", "who"].forEach(name =>
        head.classList.contains(name) && this.rows.forEach(row => row.cells[j].classList.add(name))));
      this.menus = [];
      this.limit = +box.dataset.limit || Infinity;
      this.reset();
      this.controls();
      this.show();
    }
    reset() {
      this.sort = [];
      this.columns = [...this.usual];
      this.only = this.heads.map(() => new Set());
    }

    controls() {
      this.status = make("span", { className: "status", role: "status" });
      this.chosen = make("p", { className: "chosen", hidden: true });
      this.more = button(() => { this.limit = Infinity; this.show(); });
      this.more.className = "more";
      const bar = make("details", { className: "bar" }, make("summary", {}, "Filter and copy"));
      this.heads.forEach((head, j) => {
        head.append(button(() => this.change(() => this.sortBy(j)), ...head.childNodes));
        const values = [...new Set(this.rows.map(row => plain(row.cells[j])))];
        if ("filter" in head.dataset && values.length > 1)
          bar.append(this.menu(this.titles[j], "Only", values, i => this.only[j].has(values[i]),
            (i, on) => this.only[j][on ? "add" : "delete"](values[i])));
      });
      bar.append(this.menu("columns", "Show", this.titles, j => this.columns[j],
        (j, on) => { this.columns[j] = on; }));
      for (const form of ["Markdown", "LaTeX", "CSV"])
        bar.append(button(() => this.copy(this[form](), form), "Copy " + form));
      bar.append(button(() => this.change(() => this.reset()), "Reset"), this.status);
      this.box.prepend(bar);
      this.box.append(this.more, this.chosen);
      this.rows.forEach((row, i) => row.cells[0].append(make("a", {
        className: "link", href: "#" + row.id, tabIndex: i ? -1 : 0, ariaLabel: "Link and command of this row",
        onclick: event => { event.preventDefault(); this.pick(row); } })));
      this.body.onkeydown = event => this.walk(event);
    }
    menu(title, legend, values, isOn, change) {
      const boxes = values.map((_, i) => make("input", { type: "checkbox",
        onchange: event => this.change(() => change(i, event.target.checked)) }));
      this.menus.push({ boxes, isOn });
      const menu = make("details", { className: "menu" }, make("summary", {}, title),
        make("fieldset", {}, make("legend", {}, legend),
          ...values.map((value, i) => make("label", {}, boxes[i], " " + value))));
      menu.onkeydown = event => {
        if (event.key !== "Escape") return;
        menu.open = false;
        menu.firstChild.focus();
      };
      return menu;
    }
    // The arrow keys move between the links of rows, of which only one takes part in tabbing.
    walk(event) {
      const shown = this.shownRows();
      const next = shown[shown.indexOf(event.target.closest("tr")) + { ArrowDown: 1, ArrowUp: -1 }[event.key]];
      if (!next || event.target.className !== "link") return;
      event.preventDefault();
      event.target.tabIndex = -1;
      next.cells[0].lastChild.tabIndex = 0;
      next.cells[0].lastChild.focus();
    }
    shownRows() { return [...this.body.rows].filter(row => !row.hidden); }

    sortBy(j) {
      const first = this.heads[j].dataset.best === "greatest" ? -1 : 1;
      const [before, sign] = this.sort;
      this.sort = before !== j ? [j, first] : sign === first ? [j, -first] : [];
    }
    change(how) {
      how();
      this.show();
      this.remember();
    }
    show() {
      const [by, sign] = this.sort, order = [...this.rows];
      if (sign) order.sort((a, b) => compare(a.cells[by], b.cells[by], sign));
      this.body.append(...order);
      for (const row of order) row.hidden = start() && ![start(), undefined].includes(row.dataset.start)
        || this.only.some((values, j) => values.size && !values.has(plain(row.cells[j])));
      const shown = this.shownRows(), said = shown.map(row => plain(row.cells[0]));
      shown.forEach((row, i) => {
        row.cells[0].classList.toggle("same", i && said[i] === said[i - 1]);
        row.classList.toggle("cut", i >= this.limit);
      });
      this.more.hidden = shown.length <= this.limit;
      this.more.textContent = `Show all ${shown.length} rows`;
      for (const cells of [this.heads, ...this.rows.map(row => [...row.cells])])
        cells.forEach((cell, j) => cell.classList.toggle("folded", !this.columns[j]));
      let at = 0;
      for (const group of this.groups) {
        const span = +(group.dataset.span ??= group.colSpan);
        const left = this.columns.slice(at, at += span).filter(Boolean).length;
        group.colSpan = left || 1;
        group.hidden = !left;
      }
      this.heads.forEach((head, j) => {
        head.ariaSort = j !== by ? "none" : sign > 0 ? "ascending" : "descending";
      });
      for (const { boxes, isOn } of this.menus) boxes.forEach((box, i) => { box.checked = isOn(i); });
      this.status.textContent = `${shown.length} of ${this.rows.length} rows`;
    }

    pick(row) {
      this.choose(row);
      this.remember();
    }
    choose(row) {
      if (row) this.limit = Infinity;
      this.row?.removeAttribute("aria-current");
      this.row = row;
      this.chosen.hidden = !row;
      if (!row) return;
      row.ariaCurrent = "true";
      const run = row.dataset.run;
      this.chosen.replaceChildren(
        ...(run ? [make("code", {}, run), button(() => this.copy(run, "command"), "Copy command")] : []),
        button(() => this.pick(), "Close"));
    }
    remember() {
      const kept = new URLSearchParams(), [by, sign] = this.sort;
      if (sign) kept.set("sort", by + (sign > 0 ? "" : "-"));
      if (listed(this.columns) !== listed(this.usual)) kept.set("columns", listed(this.columns));
      this.only.forEach((values, j) => values.forEach(value => kept.append("by" + j, value)));
      history.replaceState(null, "", `#${(this.row ?? this.box).id}${kept.size ? "?" + kept : ""}`);
    }
    restore(kept, row) {
      this.reset();
      const by = parseInt(kept.get("sort"));
      if (this.heads[by]) this.sort = [by, kept.get("sort").endsWith("-") ? -1 : 1];
      const columns = kept.get("columns")?.split(".");
      if (columns) this.columns = this.columns.map((_, j) => columns.includes(String(j)));
      for (const [key, value] of kept) if (/^by/.test(key)) this.only[key.slice(2)]?.add(value);
      this.choose(row);
      this.show();
    }

    // Heading and rows as they are seen, each cell written by a function.
    written(write) {
      return [this.heads, ...this.shownRows().map(row => [...row.cells])].map(cells =>
        cells.flatMap((cell, j) => this.columns[j] ? write(cell, j) : []));
    }
    aligned(left, right) {
      return this.written(cell => cell.classList.contains("words") ? left : right)[0];
    }
    Markdown() {
      const lines = this.written(cell => {
        const text = plain(cell).replace(/[\\`*_|<>]/g, "\\$&");
        return cell.classList.contains("best") ? `**${text}**` : text;
      });
      lines.splice(1, 0, this.aligned("---", "---:"));
      return lines.map(cells => `| ${cells.join(" | ")} |\n`).join("");
    }
    LaTeX() {
      const marks = { "\\": "\\textbackslash{}", "~": "\\textasciitilde{}", "^": "\\textasciicircum{}",
        "≤": "$\\leq$", "≥": "$\\geq$", "×": "$\\times$", "ω": "$\\omega$", "[": "{[}", "]": "{]}" };
      const [head, ...rows] = this.written(cell => {
        const text = plain(cell).replace(/[\\{}$&#%_^~\[\]≤≥×ω]/g, mark => marks[mark] ?? "\\" + mark)
          .replace(/(?<![\w.])(-?[\d.]+)e(-?\d+)(?!\w)/g, "$$$1 \\cdot 10^{$2}$$");
        return cell.classList.contains("best") ? `\\textbf{${text}}` : text;
      }).map(cells => cells.join(" & ") + " \\\\");
      return ["% needs \\usepackage{booktabs}", `\\begin{tabular}{${this.aligned("l", "r").join("")}}`,
        "\\toprule", head, "\\midrule", ...rows, "\\bottomrule", "\\end{tabular}", ""].join("\n");
    }
    // All digits are kept; a share becomes its four parts.
    CSV() {
      return this.written((cell, j) => {
        const names = this.heads[j].dataset.name.split(","), { name, v } = cell.dataset;
        if (name) return names;
        return v?.split("/") ?? names.map(() => plain(cell).replace(/^–$/, ""));
      }).map(cells => cells.map(text => /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text) + "\n").join("");
    }
    async copy(text, what) {
      const done = navigator.clipboard?.writeText(text) ?? Promise.reject();
      this.status.textContent = await done.then(() => `Copied: ${what}`, () => "The browser refuses to copy");
    }
  }

  const views = new Map();
  const viewOf = box => views.get(box) ?? views.set(box, new View(box)).get(box);
  const prepare = part => part.querySelectorAll(".data").forEach(viewOf);
  const turn = value => {
    for (const input of starts) input.checked = input.value === value;
    views.forEach(view => view.show());
  };
  for (const input of starts) input.onchange = () => turn(input.value);
  // A box with more to its right fades there, and says so.
  document.querySelectorAll(".scroll").forEach(box => {
    box.onscroll = () =>
      box.classList.toggle("onward", box.scrollWidth - box.clientWidth - box.scrollLeft > 2);
    new ResizeObserver(() => requestAnimationFrame(box.onscroll)).observe(box);
  });
  const follow = () => {
    const [, id, kept] = /^#([^?]*)\??(.*)$/s.exec(location.hash) ?? [];
    const found = document.getElementById(id), box = found?.closest(".data");
    for (let fold = found; (fold = fold?.parentElement.closest("details"));) fold.open = true;
    if (!box) return found?.scrollIntoView();
    const row = found === box ? null : found.closest("tr");
    if (row?.dataset.start) turn(row.dataset.start);
    viewOf(box).restore(new URLSearchParams(kept), row);
    found.scrollIntoView({ block: row ? "center" : "start", behavior: "instant" });
  };
  document.querySelectorAll(".folds details").forEach(fold =>
    fold.addEventListener("toggle", () => fold.open && prepare(fold)));
  document.querySelectorAll("article").forEach(prepare);
  document.addEventListener("click", event =>
    document.querySelectorAll(".menu[open]").forEach(menu => menu.contains(event.target) || (menu.open = false)));
  addEventListener("hashchange", follow);
  follow();
})();
