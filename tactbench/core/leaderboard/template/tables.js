// The leaderboards: every block of the table, sorted inside, a page at a time.
const PAGE = 200;
const PRINTED = 2000;

const state = { sort: null, page: 0, matrixSort: null, matrixPage: 0, size: PAGE, view: "tables" };

// What rows are compared by in a column: numbers by value, texts by their place among all texts.
const keysOf = ({ column }) => {
  if (!column.sort) {
    const place = textKeys(column.dictionary.map(asText));
    column.sort = Float64Array.from(column.index, (one) => place[one]);
  }
  return column.sort;
};

const turn = (sort, place, first = false) =>
  sort && sort.place === place ? { place, descending: !sort.descending } : { place, descending: first };

const heading = (name, numeric, place, sort, again) =>
  make("th", { scope: "col", class: numeric ? "number" : "", "aria-sort":
    sort && sort.place === place ? (sort.descending ? "descending" : "ascending") : "none" },
    make("button", { type: "button", onclick: () => again(place) }, name));

const linesOfBlocks = () => {
  const keys = state.sort ? keysOf(board.columns[state.sort.place]) : null;
  return board.head.blocks.map((block, place) => ({ block, rows: board.rowsOf(place) })).filter(({ rows }) => rows.length)
    .map(({ block, rows }) => ({ block, rows: keys ? sorted(rows, keys, state.sort.descending) : rows }));
};

const isStopped = (kind) => kind !== "result" && kind !== "baseline";

const drawLine = (row) => {
  const kind = board.kinds.text(row), line = make("tr", { class: kind }), columns = board.visibleColumns;
  let onTheWay = true;
  for (const [place, { name, numeric, column }] of columns.entries()) {
    const text = column.text(row), isNumber = numeric && text !== "" && text !== ABSENT;
    if (isStopped(kind) && numeric && !isNumber && place > 0) {
      const why = board.field("reason", row) || board.field("status", row);
      line.append(make("td", { class: "reason", colspan: columns.length - place }, link(row, why, onTheWay)));
      break;
    }
    const isScore = name === ROLES.score;
    line.append(make("td", { class: numeric ? "number" : "" }, isNumber ? link(row, text, onTheWay && isScore) : text));
    if (isNumber && isScore) onTheWay = false;
  }
  return line;
};

const drawTables = () => {
  const table = byId("lines");
  const active = document.activeElement?.closest?.("#lines th")?.cellIndex;
  const blocks = linesOfBlocks();
  const total = blocks.reduce((sum, one) => sum + one.rows.length, 0);
  state.page = Math.min(state.page, Math.max(0, Math.ceil(total / state.size) - 1));
  const from = state.page * state.size, to = from + state.size;
  const again = (place) => { state.sort = turn(state.sort, place); state.page = 0; drawTables(); };
  table.tHead.replaceChildren(make("tr", {}, ...board.visibleColumns.map((one) =>
    heading(one.name, one.numeric, one.place, state.sort, again))));
  for (const body of [...table.tBodies]) body.remove();
  let at = 0;
  for (const { block, rows } of blocks) {
    if (at < to && at + rows.length > from) {
      const some = rows.slice(Math.max(0, from - at), to - at);
      const part = some.length < rows.length || rows.length < block.size
        ? ` · ${whole(some.length)} of ${whole(block.size)} cells` : "";
      table.append(make("tbody", {},
        make("tr", { class: "block" }, make("th", { scope: "rowgroup", colspan: board.visibleColumns.length },
          make("span", {}, block.title, make("small", {}, part)),
          ...block.verdict.map((said) => make("p", { class: "verdict" }, said)))),
        ...some.map(drawLine)));
    }
    at += rows.length;
  }
  drawPager("lines-pager", "lines", state.page, state.size, total, (page) => {
    state.page = page;
    drawTables();
    table.parentElement.scrollTop = 0;
    table.scrollIntoView({ block: "nearest" });
  });
  if (active !== undefined && active >= 0) table.tHead.rows[0].cells[active]?.querySelector("button")?.focus();
};

const drawPager = (id, what, page, size, total, go) => {
  const pager = byId(id);
  const last = Math.max(0, Math.ceil(total / size) - 1);
  const focused = pager.contains(document.activeElement) ? document.activeElement.dataset.go : null;
  const button = (name, label, target) => make("button", { type: "button", "data-go": name,
    disabled: target === page, onclick: () => go(target) }, label);
  pager.hidden = !last;
  pager.replaceChildren(
    button("first", "First", 0), button("before", "Previous", Math.max(0, page - 1)),
    make("span", {}, `${what} ${whole(total ? page * size + 1 : 0)} to ${whole(Math.min(total, (page + 1) * size))} of ${whole(total)}`),
    button("next", "Next", Math.min(last, page + 1)), button("last", "Last", last));
  if (focused) (pager.querySelector(`[data-go="${focused}"]:not([disabled])`) ?? pager.querySelector("button:not([disabled])"))?.focus();
};
