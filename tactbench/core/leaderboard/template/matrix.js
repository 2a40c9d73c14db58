// The matrix: lines are sensors and estimators, columns are blocks; scores as the tables show them.
const MATRIX_PAGE = 100;

const matrixLines = () => {
  const sensor = board.role("sensor"), estimator = board.role("estimator");
  const lines = new Map(), columns = [];
  for (const place of board.head.blocks.keys()) {
    const rows = board.rowsOf(place);
    if (rows.length) columns.push(place);
    for (const row of rows) {
      const names = [sensor.column.text(row), estimator.column.text(row)], name = JSON.stringify(names);
      if (!lines.has(name)) lines.set(name, { names, cells: new Map() });
      lines.get(name).cells.set(place, row);
    }
  }
  return { lines: [...lines.values()], columns };
};

const compareNames = (one, other) =>
  words.compare(one.names[0], other.names[0]) || words.compare(one.names[1], other.names[1]);

const drawMatrix = () => {
  const table = byId("matrix");
  const { head } = board;
  const active = document.activeElement?.closest?.("#matrix thead th")?.cellIndex;
  const score = board.role("score"), rank = board.role("rank");
  const values = keysOf(score);
  let { lines, columns } = matrixLines();
  const sort = state.matrixSort;
  lines.sort(compareNames);
  if (sort && typeof sort.place === "string") {
    const which = sort.place === "sensor" ? 0 : 1;
    lines.sort((one, other) => words.compare(one.names[which], other.names[which]) * (sort.descending ? -1 : 1));
  } else if (sort) {
    const value = (line) => { const row = line.cells.get(sort.place); return row === undefined ? NaN : values[row]; };
    const keys = lines.map(value);
    lines = sorted(lines.keys(), keys, sort.descending).map((at) => lines[at]);
  }
  state.matrixPage = Math.min(state.matrixPage, Math.max(0, Math.ceil(lines.length / MATRIX_PAGE) - 1));
  const from = state.matrixPage * MATRIX_PAGE;
  const again = (place) => {
    state.matrixSort = turn(sort, place, typeof place === "number" && !head.blocks[place].lower);
    state.matrixPage = 0;
    drawMatrix();
  };
  const titles = columns.map((place) => head.blocks[place].title.split(" · "));
  const alike = titles.length > 1 ? titles[0].slice(1).filter((part) => titles.every((one) => one.includes(part))) : [];
  byId("matrix-note").textContent = visible("One line a sensor and estimator, one column a block of the tables; the first " +
    "of a column, ties too, in bold. Scores are compared down a column only." + (alike.length ? ` All columns: ${alike.join(" · ")}.` : ""));
  table.tHead.replaceChildren(make("tr", {},
    heading("sensor", false, "sensor", sort, again), heading("estimator", false, "estimator", sort, again),
    ...columns.map((place, at) => {
      const [task, ...rest] = titles[at];
      const one = heading(task, true, place, sort, again);
      one.append(make("small", {}, rest.filter((part) => !alike.includes(part)).join(" · ")));
      return one;
    })));
  table.tBodies[0].replaceChildren(...lines.slice(from, from + MATRIX_PAGE).map((line) => make("tr", {},
    make("th", { scope: "row" }, line.names[0]), make("th", { scope: "row" }, line.names[1]),
    ...columns.map((place) => {
      const row = line.cells.get(place);
      if (row === undefined) return make("td", { class: "number none" }, ABSENT);
      const kind = board.kinds.text(row);
      const best = kind === "result" && rank && parseInt(rank.column.text(row), 10) === 1;
      const text = score.column.text(row);
      return make("td", { class: `number ${kind}${best ? " best" : ""}` },
        link(row, isStopped(kind) && !/\d/.test(text) ? board.field("status", row) : text, true));
    }))));
  table.style.setProperty("--first", `${table.tHead.rows[0].cells[0].offsetWidth}px`);
  drawPager("matrix-pager", "lines", state.matrixPage, MATRIX_PAGE, lines.length, (page) => {
    state.matrixPage = page;
    drawMatrix();
    table.parentElement.scrollTop = 0;
  });
  if (active !== undefined && active >= 0) table.tHead.rows[0].cells[active]?.querySelector("button")?.focus();
};
