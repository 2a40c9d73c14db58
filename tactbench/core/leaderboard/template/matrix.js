// The matrix: lines are sensors and estimators, columns are blocks; scores as the tables show them.
const MATRIX_PAGE = 100;

// Each line has its two names and, by block, its row.
const matrixLines = (columns) => {
  const [sensor, estimator] = ["sensor", "estimator"].map((name) => board.role(name).column);
  const lines = new Map();
  for (const place of columns) {
    for (const row of board.rowsOf(place)) {
      const names = [sensor.text(row), estimator.text(row)], name = JSON.stringify(names);
      if (!lines.has(name)) lines.set(name, { names, cells: new Map() });
      lines.get(name).cells.set(place, row);
    }
  }
  return [...lines.values()].sort((one, other) =>
    words.compare(one.names[0], other.names[0]) || words.compare(one.names[1], other.names[1]));
};

const drawMatrix = () => {
  const table = byId("matrix"), { blocks } = board.head, { sort } = state.matrix;
  const score = board.role("score"), rank = board.role("rank"), values = keysOf(score);
  const columns = [...blocks.keys()].filter((place) => board.rowsOf(place).length);
  let lines = matrixLines(columns);
  if (sort) {
    const { place } = sort, name = ["sensor", "estimator"].indexOf(place);
    const keys = name < 0 ? lines.map(({ cells }) => values[cells.get(place)] ?? NaN)
      : textKeys(lines.map(({ names }) => names[name]));
    lines = sorted(lines.keys(), keys, sort.descending).map((at) => lines[at]);
  }
  const from = drawPager("matrix", lines.length, MATRIX_PAGE, drawMatrix);
  const titles = columns.map((place) => blocks[place].title.split(" · "));
  const alike = titles.length > 1 ? titles[0].slice(1).filter((part) => titles.every((one) => one.includes(part))) : [];
  byId("matrix-note").textContent = visible("One line a sensor and estimator, one column a block of the tables; the first " +
    "of a column, ties too, in bold. Scores are compared down a column only." + (alike.length ? ` All columns: ${alike.join(" · ")}.` : ""));
  drawHead("matrix", [{ name: "sensor", place: "sensor" }, { name: "estimator", place: "estimator" },
    ...columns.map((place, at) => {
      const [name, ...rest] = titles[at];
      const below = [make("small", {}, rest.filter((part) => !alike.includes(part)).join(" · "))];
      return { name, numeric: true, place, descending: !blocks[place].lower, below };
    })], drawMatrix);
  table.tBodies[0].replaceChildren(...lines.slice(from, from + MATRIX_PAGE).map(({ names, cells }) => make("tr", {},
    ...names.map((name) => make("th", { scope: "row" }, name)),
    ...columns.map((place) => {
      const row = cells.get(place);
      if (row === undefined) return make("td", { class: "number none" }, ABSENT);
      const kind = board.kinds.text(row), text = score.column.text(row);
      const best = kind === "result" && rank && parseInt(rank.column.text(row), 10) === 1;
      return make("td", { class: `number ${kind}${best ? " best" : ""}` },
        link(row, isStopped(kind) && !/\d/.test(text) ? board.field("status", row) : text, true));
    }))));
  table.style.setProperty("--first", `${table.tHead.rows[0].cells[0].offsetWidth}px`);
};
