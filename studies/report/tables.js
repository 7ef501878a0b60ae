"use strict";
// Tables sorted by a click on a heading, and back; filtered by words, and by menus of few values.
(() => {
  const FEW = 24; // values of a menu
  const LEAST = 4; // rows of a table with filters
  const STATES = ["ascending", "descending", "none"];

  const text = (cell) => cell.textContent.trim();
  const missing = (cell) => text(cell) === "" || text(cell) === "-";
  const collator = new Intl.Collator("en", { numeric: true });

  function compare(a, b, number, sign) {
    const none = missing(a) - missing(b); // missing ones last, either way
    if (none) return none;
    if (!number) return sign * collator.compare(text(a), text(b));
    const [x, y] = [a.dataset.v, b.dataset.v];
    if (!x || !y) return !x - !y; // text among numbers after them
    return sign * (Number(x) - Number(y) || 0);
  }

  function sort(table, heads, column, state, rows) {
    heads.forEach((head, i) => head.setAttribute("aria-sort", i === column ? state : "none"));
    const sign = state === "descending" ? -1 : 1;
    const number = heads[column].classList.contains("n");
    const by = (a, b) => compare(a.cells[column], b.cells[column], number, sign);
    table.tBodies[0].append(...(state === "none" ? rows : [...rows].sort(by)));
  }

  function sortable(table, rows) {
    const heads = [...table.tHead.rows[0].cells];
    heads.forEach((head, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.append(...head.childNodes);
      head.append(button);
      head.setAttribute("aria-sort", "none");
      button.addEventListener("click", () => {
        const now = STATES.indexOf(head.getAttribute("aria-sort"));
        sort(table, heads, column, STATES[(now + 1) % STATES.length], rows);
      });
    });
    return heads;
  }

  function labelled(words, control) {
    const label = document.createElement("label");
    label.append(words, control);
    return label;
  }

  function menu(name, values) {
    const select = document.createElement("select");
    select.append(new Option("all", ""), ...values.map((value) => new Option(value, `=${value}`)));
    return [labelled(name, select), select];
  }

  function filters(table, heads, rows) {
    const bar = document.createElement("div");
    bar.className = "toolbar";
    const words = document.createElement("input");
    words.type = "search";
    words.setAttribute("aria-label", `Filter ${table.getAttribute("aria-label")}`);
    bar.append(labelled("Filter", words));
    const menus = [];
    heads.forEach((head, column) => {
      const values = [...new Set(rows.map((row) => text(row.cells[column])))];
      if (head.classList.contains("n") || values.length < 2 || values.length > FEW) return;
      if (values.length === rows.length) return;
      const [label, select] = menu(text(head.querySelector("span")), values);
      menus.push([column, select]);
      bar.append(label);
    });
    const count = document.createElement("span");
    count.setAttribute("role", "status");
    bar.append(count);
    const update = () => {
      const sought = words.value.trim().toLowerCase();
      let shown = 0;
      for (const row of rows) {
        const own = [...row.cells].map(text).join("\t").toLowerCase();
        row.hidden = !(
          own.includes(sought) &&
          menus.every(([i, select]) => !select.value || select.value === `=${text(row.cells[i])}`)
        );
        shown += !row.hidden;
      }
      count.textContent = shown === rows.length ? "" : `${shown} of ${rows.length} rows`;
    };
    bar.addEventListener("input", update);
    bar.addEventListener("change", update);
    table.closest("figure").insertBefore(bar, table.parentElement);
  }

  for (const table of document.querySelectorAll("table.data")) {
    const rows = [...table.tBodies[0].rows];
    const heads = sortable(table, rows);
    if (rows.length >= LEAST) filters(table, heads, rows);
  }
})();
