// Sorting of tables: numbers by value, texts by their words. It is stable, and what has neither comes last either way.
const words = new Intl.Collator("en", { numeric: true, sensitivity: "base" });

// What texts are compared by: the place of each among all; empty ones have none.
const textKeys = (texts) => {
  const keys = new Float64Array(texts.length).fill(NaN);
  [...texts.keys()].filter((one) => texts[one] && texts[one] !== "–")
    .sort((one, other) => words.compare(texts[one], texts[other]))
    .forEach((one, order, all) => {
      const before = order ? all[order - 1] : -1;
      keys[one] = order && !words.compare(texts[one], texts[before]) ? keys[before] : order;
    });
  return keys;
};

const sorted = (places, keys, descending) => {
  const there = [], missing = [];
  for (const place of places) (Number.isNaN(keys[place]) ? missing : there).push(place);
  there.sort(descending ? (one, other) => keys[other] - keys[one] : (one, other) => keys[one] - keys[other]);
  return there.concat(missing);
};

for (const button of document.querySelectorAll("table.sortable th button")) {
  button.addEventListener("click", () => {
    const heading = button.parentElement, table = heading.closest("table");
    const descending = heading.getAttribute("aria-sort") === "ascending";
    for (const other of table.querySelectorAll("th[aria-sort]")) other.setAttribute("aria-sort", "none");
    heading.setAttribute("aria-sort", descending ? "descending" : "ascending");
    const lines = [...table.tBodies[0].rows];
    const cells = lines.map((line) => line.cells[heading.cellIndex]);
    const keys = heading.classList.contains("number") ? cells.map((cell) => Number(cell.dataset.value ?? NaN))
      : textKeys(cells.map((cell) => cell.textContent.trim()));
    table.tBodies[0].append(...sorted(lines.keys(), keys, descending).map((at) => lines[at]));
  });
}
