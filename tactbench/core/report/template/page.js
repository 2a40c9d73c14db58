
"use strict";
(() => {
  // A link to a cell unfolds it, before the browser goes there.
  const unfold = (hash) => {
    const cell = hash.length > 1 ? document.getElementById(decodeURIComponent(hash.slice(1))) : null;
    if (cell instanceof HTMLDetailsElement) cell.open = true;
    return cell;
  };
  document.addEventListener("click", (event) => {
    const link = event.target instanceof Element ? event.target.closest('a[href^="#"]') : null;
    if (link) unfold(link.hash);
  });
  window.addEventListener("hashchange", () => unfold(location.hash));
  // Paper cannot be unfolded.
  window.addEventListener("beforeprint", () => {
    for (const notes of document.querySelectorAll("details.folded")) notes.open = true;
  });
  const first = unfold(location.hash);
  if (first) first.scrollIntoView();

  // Numbers by their value, text by its words; what has neither comes last either way round. Sorting is stable.
  const words = new Intl.Collator("en", { numeric: true, sensitivity: "base" });
  const compare = (one, other, numeric, turned) => {
    const missing = (cell) => (numeric ? cell.dataset.value === undefined : cell.textContent.trim() === "");
    if (missing(one) || missing(other)) return missing(one) - missing(other);
    const order = numeric
      ? Number(one.dataset.value) - Number(other.dataset.value)
      : words.compare(one.textContent.trim(), other.textContent.trim());
    return turned ? -order : order;
  };
  for (const button of document.querySelectorAll("table.sortable th button")) {
    button.addEventListener("click", () => {
      const heading = button.parentElement;
      const table = heading.closest("table");
      const turned = heading.getAttribute("aria-sort") === "ascending";
      for (const other of table.querySelectorAll("th[aria-sort]")) other.setAttribute("aria-sort", "none");
      heading.setAttribute("aria-sort", turned ? "descending" : "ascending");
      const place = heading.cellIndex;
      const numeric = heading.classList.contains("number");
      const lines = [...table.tBodies[0].rows];
      lines.sort((one, other) => compare(one.cells[place], other.cells[place], numeric, turned));
      table.tBodies[0].append(...lines);
    });
  }
})();
