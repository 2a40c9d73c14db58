// One cell with everything that the page knows of it.
const ABSENT = "–";
const tableOf = (title, columns, lines, attributes = {}) => make("table", attributes, make("caption", {}, title),
  ...(columns.length ? [make("thead", {}, make("tr", {}, ...columns.map(({ name, numeric }) =>
    make("th", { scope: "col", class: numeric ? "number" : null }, name))))] : []),
  make("tbody", {}, ...lines.map((cells) => make("tr", {}, ...cells))));

const pairs = (title, entries) => {
  const lines = entries.filter(([, text]) => text !== "");
  return lines.length ? [tableOf(title, [], lines.map(([name, text]) =>
    [make("th", { scope: "row" }, name), make("td", {}, text)]), { class: "pairs" })] : [];
};

const records = (title, list) => {
  const names = [...new Set(list.flatMap((one) => Object.keys(one)))];
  return tableOf(title, names.map((name) => ({ name })), list.map((one) => names.map((name) => make("td", {}, asText(one[name])))));
};

const crossed = (title, counts, classes) => {
  const names = counts.map((_, place) => (classes?.length === counts.length ? asText(classes[place]) : String(place)));
  const columns = ["true", ...names.map((name) => `as ${name}`)];
  return tableOf(title, columns.map((name) => ({ name })), counts.map((line, place) =>
    [make("th", { scope: "row" }, names[place]), ...[].concat(line).map((count) => make("td", { class: "number" }, asText(count)))]));
};

const isRecord = (value) => value !== null && typeof value === "object" && !Array.isArray(value);
const isEmpty = (value) => value === null || value === undefined || value === "" ||
  (typeof value === "object" && !Object.keys(value).length);

const shownAs = (title, value, classes) => {
  if (isEmpty(value)) return [];
  if (title === board.head.titles.confusion && Array.isArray(value)) return [crossed(title, value, classes)];
  if (isRecord(value)) return pairs(title, Object.entries(value).map(([name, one]) => [name, asText(one)]));
  if (!Array.isArray(value)) return pairs(title, [[title, asText(value)]]);
  if (value.every(isRecord)) return [records(title, value)];
  return [make("div", {}, make("p", { class: "caption" }, title),
    make("ul", {}, ...value.map((one) => make("li", {}, asText(one)))))];
};

// A name as one word of a shell; none where no shell should be given it.
const commands = (name) => {
  if (visible(name) !== name || /[\n\t]/.test(name)) {
    return make("p", { class: "missing" }, "Its name holds what no command line should be given.");
  }
  const word = /^[A-Za-z0-9_./:=,@%+-]+$/.test(name) ? name : `'${name.replace(/'/g, `'"'"'`)}'`;
  return make("pre", { class: "commands" }, `tactbench why ${word}\ntactbench rerun ${word}`);
};

const provenanceOf = (row) => {
  const all = board.head.provenance.map(([id, entry]) => ({ id, entry }));
  const made = board.field("made_by", row), host = board.field("host", row);
  if (made) return all.find(({ id }) => id === made)?.entry;
  // Rows of another version may not say which run made them: the only one of their host did.
  const there = all.filter(({ entry }) => host && entry.host === host);
  return there.length === 1 ? there[0].entry : undefined;
};

const provenanceTables = (entry) => {
  const [nested, single] = [true, false].map((whole) => Object.entries(entry).filter(([, value]) => isRecord(value) === whole));
  return [...pairs("Run", single.map(([name, value]) => [name, asText(value)])),
    ...nested.map(([name, value]) => make("details", {}, make("summary", {}, name), ...shownAs(name, value)))];
};

const cellBody = (row) => {
  const { groups, titles } = board.head;
  const value = (name) => board.raw(name, row);
  const isSingle = (name) => !isEmpty(value(name)) && typeof value(name) !== "object";
  const line = board.columns.map((one) => [one.name, one.column.text(row)]).filter(([, text]) => text !== ABSENT);
  return [
    ...pairs("As the table shows it", line),
    ...Object.entries(groups).flatMap(([title, names]) =>
      pairs(title, names.filter(isSingle).map((name) => [name, asText(value(name))]))),
    ...Object.entries(titles).filter(([name]) => !isSingle(name))
      .flatMap(([name, title]) => shownAs(title, value(name), value("classes"))),
  ];
};

const longText = (title, text) =>
  isEmpty(text) ? [] : [make("h3", {}, title), make("pre", { tabindex: 0, class: "log" }, asText(text))];
const note = (text) => make("p", { class: "note" }, ...prose(text));

const openCell = (row) => {
  const { head } = board;
  const name = board.field("cell", row), status = board.field("status", row), key = board.field("key", row);
  const dialog = byId("cell"), made = provenanceOf(row);
  const left = head.leftOut.map((one) => `\`${one}\``).join(", ");
  dialog.replaceChildren(
    make("header", {},
      make("h2", { id: "cell-title" }, name),
      make("button", { type: "button", class: "close", "aria-label": "Close", onclick: () => dialog.close() }, "×")),
    make("p", { class: "note" }, head.blocks[board.blockOf[row]]?.title ?? ""),
    make("div", { class: `ended ${status === "done" ? "good" : "bad"}` }, make("strong", {}, status || "?"),
      status === "done" ? "" : `: ${board.field("reason", row)}`),
    commands(name),
    ...longText("Traceback", board.raw("traceback", row)),
    ...longText("What the cell printed", board.raw("log", row)),
    make("div", { class: "tables" }, ...cellBody(row)),
    make("h3", {}, "Made by"),
    ...(made ? provenanceTables(made) : [note("This page was given no provenance of the run that made this cell.")]),
    ...(key ? [note(`Its own file in the result folder, with every answer: \`cells/${key}${key.length < 64 ? "…" : ""}.h5\`.`)] : []),
    ...(left ? [note(`This page is kept small: of each cell it leaves out ${left}. They are in the cell's own file.`)] : []));
  if (!dialog.open) dialog.showModal();
  dialog.scrollTop = 0;
};

// A number, and the way to its cell. One number a line is on the keyboard's way: all of a line lead to one cell.
const link = (row, text, onTheWay) =>
  make("a", { href: `#cell=${address(board.field("cell", row))}`, tabindex: onTheWay ? null : -1 }, text);

const follow = () => {
  const dialog = byId("cell");
  if (!location.hash.startsWith("#cell=")) {
    if (dialog.open) dialog.close();
    const view = /^#view=(\w+)$/.exec(location.hash);
    if (view) show(view[1]);
    return;
  }
  let cell = location.hash.slice("#cell=".length);
  try { cell = decodeURIComponent(cell); } catch { /* no address of ours */ }
  board.rowAt ??= new Map(board.head.order.map((row) => [address(board.field("cell", row)), row]));
  const row = board.rowAt.get(cell);
  if (row === undefined) say(`This board has no cell ${cell}.`);
  else openCell(row);
};
