// The leaderboards: every block of the table, sorted inside, a page at a time.
const PAGE = 200;
const PRINTED = 2000;

// What a grid is sorted by, and which of its pages is shown.
const state = { view: "tables", size: PAGE, lines: { sort: null, page: 0 }, matrix: { sort: null, page: 0 } };

// What rows are compared by in a column: numbers by value, texts by their place among all texts.
const keysOf = ({ column }) => {
  if (!column.sort) {
    const place = textKeys(column.dictionary.map(asText));
    column.sort = Float64Array.from(column.index, (one) => place[one]);
  }
  return column.sort;
};

// The headings of a grid; each sorts by its place, again the other way round.
const drawHead = (id, headings, redraw) => {
  const grid = state[id], { tHead } = byId(id);
  const focused = tHead.contains(document.activeElement) ? document.activeElement.parentElement.cellIndex : -1;
  tHead.replaceChildren(make("tr", {}, ...headings.map(({ name, numeric, place, descending = false, below = [] }) => {
    const mine = grid.sort?.place === place;
    const again = () => {
      grid.sort = { place, descending: mine ? !grid.sort.descending : descending };
      grid.page = 0;
      redraw();
    };
    const order = mine ? (grid.sort.descending ? "descending" : "ascending") : "none";
    return make("th", { scope: "col", class: numeric ? "number" : "", "aria-sort": order },
      make("button", { type: "button", onclick: again }, name), ...below);
  })));
  tHead.rows[0].cells[focused]?.querySelector("button").focus();
};

// The buttons that turn the pages of a grid; returns the first line of the page.
const drawPager = (id, total, size, redraw) => {
  const grid = state[id], pager = byId(`${id}-pager`);
  const last = Math.max(0, Math.ceil(total / size) - 1);
  grid.page = Math.min(grid.page, last);
  const from = grid.page * size;
  const focused = pager.contains(document.activeElement) ? document.activeElement.dataset.go : null;
  const go = (page) => {
    grid.page = page;
    redraw();
    byId(id).parentElement.scrollTop = 0;
    byId(id).scrollIntoView({ block: "nearest" });
  };
  const button = (name, label, page) => make("button", { type: "button", "data-go": name,
    disabled: page === grid.page, onclick: () => go(page) }, label);
  pager.hidden = !last;
  pager.replaceChildren(
    button("first", "First", 0), button("before", "Previous", Math.max(0, grid.page - 1)),
    make("span", {}, `lines ${whole(total && from + 1)} to ${whole(Math.min(total, from + size))} of ${whole(total)}`),
    button("next", "Next", Math.min(last, grid.page + 1)), button("last", "Last", last));
  if (focused) (pager.querySelector(`[data-go="${focused}"]:enabled`) ?? pager.querySelector("button:enabled"))?.focus();
  return from;
};

const isStopped = (kind) => kind !== "result" && kind !== "baseline";

const drawLine = (row) => {
  const kind = board.kinds.text(row), line = make("tr", { class: kind }), columns = board.visibleColumns;
  for (const [place, { name, numeric, column }] of columns.entries()) {
    const text = column.text(row), isNumber = numeric && text !== "" && text !== ABSENT;
    if (isStopped(kind) && numeric && !isNumber && place > 0) {
      const why = board.field("reason", row) || board.field("status", row);
      line.append(make("td", { class: "reason", colspan: columns.length - place }, link(row, why, false)));
      break;
    }
    line.append(make("td", { class: numeric ? "number" : "" }, isNumber ? link(row, text, name === ROLES.score) : text));
  }
  return line;
};

const drawTables = () => {
  const table = byId("lines"), columns = board.visibleColumns, { sort } = state.lines;
  const blocks = board.head.blocks.map((block, place) => ({ block, rows: board.rowsOf(place) }));
  const from = drawPager("lines", blocks.reduce((sum, { rows }) => sum + rows.length, 0), state.size, drawTables);
  drawHead("lines", columns, drawTables);
  for (const body of [...table.tBodies]) body.remove();
  let at = 0;
  for (const { block, rows } of blocks) {
    const ordered = sort ? sorted(rows, keysOf(board.columns[sort.place]), sort.descending) : rows;
    const some = ordered.slice(Math.max(0, from - at), Math.max(0, from + state.size - at));
    at += rows.length;
    if (!some.length) continue;
    const part = some.length < block.size ? ` · ${whole(some.length)} of ${whole(block.size)} cells` : "";
    table.append(make("tbody", {},
      make("tr", { class: "block" }, make("th", { scope: "rowgroup", colspan: columns.length },
        make("span", {}, block.title, make("small", {}, part)),
        ...block.verdict.map((said) => make("p", { class: "verdict" }, said)))),
      ...some.map(drawLine)));
  }
};
