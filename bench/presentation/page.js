"use strict";
// Tables that sort, filter, choose their columns, link to a row and copy what is shown. Controls are
// made when a table is first seen. The address keeps the view: #table:row?sort=2-&columns=0.1&by1=X
(() => {
  const make = (tag, attributes, ...children) => {
    const element = Object.assign(document.createElement(tag), attributes);
    element.append(...children);
    return element;
  };
  const plain = cell => {
    const copy = cell.cloneNode(true);
    copy.querySelectorAll("sup").forEach(sup => sup.replaceWith("^" + sup.textContent));
    return copy.textContent.replace(/ · 10\^−?(\d+)/g, (all, n) => (all.includes("−") ? "e-" : "e") + n)
      .replace(/−(?=\d)/g, "-").replace(/\s+/g, " ").trim();
  };
  // Percent signs are decoded in the name only: values stand in parameters of their own.
  const decoded = text => {
    const [id, ...rest] = text.split("?");
    try { return [decodeURIComponent(id), ...rest].join("?"); } catch { return ""; }
  };
  const number = cell => {
    const [value, total] = (cell.dataset.v ?? "").split("/");
    return value === "" ? NaN : total === undefined ? +value : value / total;
  };

  class View {
    constructor(box) {
      this.box = box;
      this.table = box.querySelector("table");
      this.body = this.table.tBodies[0];
      this.rows = [...this.body.rows];
      this.groups = [...this.table.querySelectorAll("th.group")];
      this.heads = [...this.table.tHead.rows].at(-1).cells;
      this.titles = [...this.heads].map(plain);
      this.usual = this.titles.map((_, j) => !this.heads[j].classList.contains("folded"));
      this.menus = {};
      this.reset();
      this.controls();
      this.show();
    }
    reset() {
      this.sort = null;
      this.columns = [...this.usual];
      this.only = {};
    }

    controls() {
      this.status = make("span", { className: "status", role: "status" });
      const bar = make("div", { className: "bar", role: "group" });
      bar.setAttribute("aria-label", "Controls of the table " + this.table.caption.textContent);
      [...this.heads].forEach((head, j) => {
        const text = [...head.childNodes];
        const button = make("button", { type: "button" }, ...text);
        button.onclick = () => this.change(() => this.sortBy(j));
        head.append(button);
        const values = [...new Set(this.rows.map(row => plain(row.cells[j])))];
        if ("filter" in head.dataset && values.length > 1)
          bar.append(this.menu("by" + j, this.titles[j], values, (value, on) => {
            const chosen = (this.only[j] ??= new Set());
            on ? chosen.add(value) : chosen.delete(value);
          }));
      });
      bar.append(this.menu("columns", "columns", this.titles, (title, on) => {
        this.columns[this.titles.indexOf(title)] = on;
      }));
      for (const form of ["Markdown", "LaTeX", "CSV"])
        bar.append(this.button("Copy " + form, () => this.copy(this[form](), form)));
      bar.append(this.button("Reset", () => this.change(() => this.reset())), this.status);
      this.box.prepend(bar);
      this.chosen = make("p", { className: "chosen", hidden: true });
      this.box.append(this.chosen);
      for (const row of this.rows) {
        const link = make("a", { className: "link", href: "#" + row.id, tabIndex: -1 });
        link.setAttribute("aria-label", "Link and command of this row");
        link.onclick = event => { event.preventDefault(); this.choose(row); this.remember(); };
        row.cells[0].append(link);
      }
      this.rows[0].cells[0].lastChild.tabIndex = 0;
      this.body.onkeydown = event => this.walk(event);
    }
    button(text, onclick) { return make("button", { type: "button", onclick }, text); }
    menu(key, title, values, change) {
      const boxes = values.map(value => {
        const box = make("input", { type: "checkbox" });
        box.onchange = () => this.change(() => change(value, box.checked));
        return box;
      });
      this.menus[key] = { boxes, values };
      const labels = values.map((value, i) => make("label", {}, boxes[i], " " + value));
      const menu = make("details", { className: "menu" }, make("summary", {}, title),
        make("fieldset", {}, make("legend", {}, key === "columns" ? "Show" : "Only"), ...labels));
      menu.onkeydown = event => {
        if (event.key !== "Escape") return;
        menu.open = false;
        menu.firstChild.focus();
      };
      return menu;
    }
    walk(event) {
      const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
      const row = event.target.closest(".link") && event.target.closest("tr");
      if (!step || !row) return;
      const shown = [...this.body.rows].filter(row => !row.hidden);
      const next = shown[shown.indexOf(row) + step];
      if (!next) return;
      event.preventDefault();
      event.target.tabIndex = -1;
      next.cells[0].lastChild.tabIndex = 0;
      next.cells[0].lastChild.focus();
    }

    sortBy(j) {
      const first = this.heads[j].dataset.best === "greatest" ? -1 : 1;
      const [before, sign] = this.sort ?? [];
      this.sort = before !== j ? [j, first] : sign === first ? [j, -first] : null;
    }
    change(how) {
      how();
      this.show();
      this.remember();
    }
    show() {
      const [by, sign] = this.sort ?? [-1, 1];
      const order = [...this.rows];
      if (by >= 0) order.sort((a, b) => this.compare(a.cells[by], b.cells[by], sign));
      this.body.append(...order);
      let before = "", count = 0;
      for (const row of order) {
        row.hidden = Object.entries(this.only).some(([j, values]) =>
          values.size && !values.has(plain(row.cells[j])));
        if (row.hidden) continue;
        const first = row.cells[0].textContent;
        row.cells[0].classList.toggle("same", first === before);
        before = first;
        count++;
      }
      for (const row of [[...this.heads], ...this.rows.map(row => [...row.cells])])
        row.forEach((cell, j) => cell.classList.toggle("folded", !this.columns[j]));
      let at = 0;
      for (const group of this.groups) {
        const span = +(group.dataset.span ??= group.colSpan);
        const shown = this.columns.slice(at, at += span).filter(Boolean).length;
        group.colSpan = shown || 1;
        group.hidden = !shown;
      }
      [...this.heads].forEach((head, j) =>
        head.setAttribute("aria-sort", j !== by ? "none" : sign > 0 ? "ascending" : "descending"));
      for (const [key, { boxes, values }] of Object.entries(this.menus)) boxes.forEach((box, i) => {
        box.checked = key === "columns" ? this.columns[i] : !!this.only[key.slice(2)]?.has(values[i]);
      });
      const all = this.rows.length;
      this.status.textContent = count < all ? `${count} of ${all} rows` : `${all} rows`;
    }
    compare(a, b, sign) {
      const [x, y] = [number(a), number(b)];
      if (!isNaN(x) || !isNaN(y)) return isNaN(x) ? 1 : isNaN(y) ? -1 : sign * (x - y);
      return sign * plain(a).localeCompare(plain(b), undefined, { numeric: true });
    }

    choose(row) {
      this.box.querySelector("[aria-current]")?.removeAttribute("aria-current");
      this.row = row;
      this.chosen.hidden = !row;
      if (!row) return;
      row.setAttribute("aria-current", "true");
      const run = row.dataset.run;
      this.chosen.replaceChildren(
        ...(run ? [make("code", {}, run), this.button("Copy command", () => this.copy(run, "command"))] : []),
        this.button("Copy link", () => this.copy(location.href, "link")),
        this.button("Close", () => { this.choose(null); this.remember(); }));
    }
    remember() {
      const kept = new URLSearchParams();
      if (this.sort) kept.set("sort", this.sort[0] + (this.sort[1] > 0 ? "" : "-"));
      const shown = list => list.flatMap((on, j) => on ? [j] : []).join(".");
      if (shown(this.columns) !== shown(this.usual)) kept.set("columns", shown(this.columns));
      for (const [j, values] of Object.entries(this.only))
        values.forEach(value => kept.append("by" + j, value));
      const state = kept.size ? "?" + kept : "";
      history.replaceState(null, "", "#" + (this.row ?? this.box).id + state);
    }
    restore(kept, row) {
      this.reset();
      const sort = /^(\d+)(-?)$/.exec(kept.get("sort") ?? "");
      if (sort && this.heads[sort[1]]) this.sort = [+sort[1], sort[2] ? -1 : 1];
      const columns = kept.get("columns")?.split(".");
      if (columns) this.columns = this.columns.map((_, j) => columns.includes(String(j)));
      for (const [key, value] of kept)
        if (this.menus[key] && key !== "columns") (this.only[key.slice(2)] ??= new Set()).add(value);
      this.show();
      this.choose(row);
    }

    // Heading and rows as shown, each cell written by `write`.
    shown(write) {
      const visible = [...this.columns.keys()].filter(j => this.columns[j]);
      const rows = [...this.body.rows].filter(row => !row.hidden);
      return [visible.map(j => write(this.heads[j], j)),
        ...rows.map(row => visible.map(j => write(row.cells[j], j)))];
    }
    Markdown() {
      const write = cell => {
        const text = plain(cell).replace(/[\\`*_|<>]/g, "\\$&");
        return cell.classList.contains("best") ? `**${text}**` : text;
      };
      const [head, ...rows] = this.shown(write).map(cells => `| ${cells.join(" | ")} |`);
      const rule = this.shown(cell => cell.classList.contains("words") ? "---" : "---:")[0];
      return [head, `| ${rule.join(" | ")} |`, ...rows, ""].join("\n");
    }
    LaTeX() {
      const marks = { "\\": "\\textbackslash{}", "~": "\\textasciitilde{}", "^": "\\textasciicircum{}",
        "−": "$-$", "≤": "$\\leq$", "≥": "$\\geq$", "×": "$\\times$", "ω": "$\\omega$", "–": "--",
        "[": "{[}", "]": "{]}" };
      const write = cell => {
        const text = plain(cell).replace(/[\\{}$&#%_^~\[\]−≤≥×ω–]/g, mark => marks[mark] ?? "\\" + mark)
          .replace(/(?<![\w.])(-?\d+(?:\.\d+)?)e(-?\d+)(?!\w)/g, "$$$1 \\cdot 10^{$2}$$");
        return cell.classList.contains("best") ? `\\textbf{${text}}` : text;
      };
      const [head, ...rows] = this.shown(write).map(cells => cells.join(" & ") + " \\\\");
      const align = this.shown(cell => cell.classList.contains("words") ? "l" : "r")[0].join("");
      return ["% needs \\usepackage{booktabs}", `\\begin{tabular}{${align}}`, "\\toprule", head, "\\midrule",
        ...rows, "\\bottomrule", "\\end{tabular}", ""].join("\n");
    }
    CSV() {
      const isShare = this.titles.map((_, j) => this.rows.some(row => row.cells[j].dataset.v?.includes("/")));
      const parts = ["hits", "total", "95 % low", "95 % high"];
      const write = (cell, j) => {
        const value = cell.dataset.v;
        if (cell.tagName === "TH" && cell.scope === "col")
          return isShare[j] ? parts.map(part => `${this.titles[j]}, ${part}`) : [this.titles[j]];
        if (isShare[j]) return value ? value.split("/") : ["", "", "", ""];
        return [value ?? (plain(cell) === "–" ? "" : plain(cell))];
      };
      const quote = text => /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
      return this.shown(write).map(cells => cells.flat().map(quote).join(",") + "\n").join("");
    }
    async copy(text, what) {
      try {
        await navigator.clipboard.writeText(text);
        this.status.textContent = `Copied: ${what}`;
      } catch {
        this.status.textContent = "The browser does not let this page copy";
      }
    }
  }

  const views = new Map();
  const viewOf = box => views.get(box) ?? views.set(box, new View(box)).get(box);
  const prepare = part => part.querySelectorAll(".data").forEach(viewOf);
  const follow = () => {
    const [, id, kept] = /^#([^?]*)\??(.*)$/s.exec(decoded(location.hash)) ?? [];
    const found = id && document.getElementById(id), box = found?.closest(".data");
    if (!box) return;
    for (let fold = box.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
    const row = found.matches("tr") ? found : null;
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
