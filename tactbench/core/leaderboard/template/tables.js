// The leaderboards: every block of the table, sorted inside, a page at a time.
const PAGE = 200;
const PRINTED = 2000;

const state = { sort: null, page: 0, matrixSort: null, matrixPage: 0, size: PAGE, view: "tables" };

// What rows are compared by in a column: numbers by value, texts by their place among all texts.
const keysOf = (entry) => {
  if (entry.column.sort) return entry.column.sort;
  if (entry.keys) return entry.keys;
  const { dictionary, index } = entry.column;
  const place = textKeys(dictionary.map(asText));
  entry.keys = Float64Array.from(index, (one) => place[one]);
  return entry.keys;
};

const turn = (sort, place, first = false) =>
  sort && sort.place === place ? { place, descending: !sort.descending } : { place, descending: first };

const heading = (name, numeric, place, sort, again) =>
  make("th", { scope: "col", class: numeric ? "number" : "", "aria-sort":
    sort && sort.place === place ? (sort.descending ? "descending" : "ascending") : "none" },
    make("button", { type: "button", onclick: () => again(place) }, name));

const linesOfBlocks = () => {
  const { head, order, shown, starts } = board;
  const keys = state.sort ? keysOf(board.columns[state.sort.place]) : null;
  const found = [];
  head.blocks.forEach((block, place) => {
    const rows = [];
    for (let at = starts[place]; at < starts[place + 1]; at += 1) if (shown[order[at]]) rows.push(order[at]);
    if (rows.length) found.push({ block, place, rows: keys ? sorted(rows, keys, state.sort.descending) : rows });
  });
  return found;
};

const isStopped = (kind) => kind !== "result" && kind !== "baseline";

const drawLine = (row) => {
  const kind = board.kinds.text(row);
  const line = make("tr", { class: kind });
  let onTheWay = true;
  for (let place = 0; place < board.visibleColumns.length; place += 1) {
    const { name, numeric, column } = board.visibleColumns[place];
    const text = column.text(row);
    if (isStopped(kind) && numeric && (text === ABSENT || text === "") && place > 0) {
      const why = board.field("reason", row) || board.field("status", row);
      line.append(make("td", { class: "reason", colspan: board.visibleColumns.length - place }, link(row, why, onTheWay)));
      break;
    }
    const told = numeric && text !== "" && text !== ABSENT;
    line.append(make("td", { class: numeric ? "number" : "" }, told ? link(row, text, onTheWay && isScore(name)) : text));
    if (told && isScore(name)) onTheWay = false;
  }
  return line;
};
const isScore = (name) => name === board.head.roles.score;

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
