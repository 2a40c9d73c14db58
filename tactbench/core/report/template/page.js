
"use strict";
(() => {
  // Headings become buttons that sort: numbers by value, texts by their words; what has neither comes last either way.
  const words = new Intl.Collator("en", { numeric: true });
  const compare = (one, other) => (typeof one === "number" ? one - other : words.compare(one, other));
  const valueOf = (cell, numeric) => {
    const text = numeric ? cell.dataset.value : cell.textContent.trim();
    return text && text !== "–" ? (numeric ? Number(text) : text) : null;
  };
  const sort = (table, heading) => {
    const down = heading.getAttribute("aria-sort") === "ascending", numeric = heading.classList.contains("number");
    for (const other of table.querySelectorAll("th[aria-sort]")) other.setAttribute("aria-sort", "none");
    heading.setAttribute("aria-sort", down ? "descending" : "ascending");
    const lines = [...table.tBodies[0].rows].map((line) => [line, valueOf(line.cells[heading.cellIndex], numeric)]);
    lines.sort(([, one], [, other]) => {
      if (one === null || other === null) return (one === null) - (other === null);
      return down ? compare(other, one) : compare(one, other);
    });
    table.tBodies[0].append(...lines.map(([line]) => line));
  };
  for (const heading of document.querySelectorAll("table.sortable th:not(:empty)")) {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...heading.childNodes);
    button.addEventListener("click", () => sort(heading.closest("table"), heading));
    heading.append(button);
    heading.setAttribute("aria-sort", "none");
  }

  // The filter leaves the lines of the leaderboard that have all its words, in the line or above its table.
  const filter = document.getElementById("filter");
  if (filter) {
    const blocks = [...document.querySelectorAll("#leaderboards .block")];
    const every = document.querySelectorAll("#leaderboards tbody tr").length;
    filter.addEventListener("input", () => {
      const asked = filter.value.toLowerCase().split(/\s+/);
      let found = 0;
      for (const block of blocks) {
        const title = block.querySelector(".caption").textContent + block.querySelector(".verdict")?.textContent;
        block.hidden = true;
        for (const line of block.querySelectorAll("tbody tr")) {
          const text = [title, ...[...line.cells].map((cell) => cell.textContent)].join(" ").toLowerCase();
          line.hidden = !asked.every((word) => text.includes(word));
          if (!line.hidden) { block.hidden = false; found += 1; }
        }
      }
      document.getElementById("found").textContent = filter.value ? `${found} of ${every} cells` : "";
    });
    filter.closest("p").hidden = false;
  }

  // A link to a cell unfolds it: browsers before 2025 do not by themselves.
  const unfold = (hash) => {
    const cell = hash.length > 1 ? document.getElementById(hash.slice(1)) : null;
    cell?.closest("details")?.setAttribute("open", "");
    return cell;
  };
  document.addEventListener("click", (event) => {
    const link = event.target.closest('a[href^="#"]');
    if (link) unfold(link.hash);
  });
  unfold(location.hash)?.scrollIntoView();
})();
