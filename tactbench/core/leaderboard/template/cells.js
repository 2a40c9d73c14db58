// One cell with everything that the page knows of it.
const ABSENT = "–";
const pairs = (title, entries) => {
  const lines = entries.filter(([, value]) => value !== "" && value !== undefined);
  if (!lines.length) return [];
  const body = lines.map(([name, value]) =>
    make("tr", {}, make("th", { scope: "row" }, name), make("td", {}, ...(Array.isArray(value) ? value : [value]))));
  return [make("table", { class: "pairs" }, make("caption", {}, title), make("tbody", {}, ...body))];
};

const records = (title, list) => {
  const names = [...new Set(list.flatMap((one) => Object.keys(one)))];
  const head = make("tr", {}, ...names.map((name) => make("th", { scope: "col" }, name)));
  const body = list.map((one) => make("tr", {}, ...names.map((name) => make("td", {}, asText(one[name])))));
  return make("table", {}, make("caption", {}, title), make("thead", {}, head), make("tbody", {}, ...body));
};

const crossed = (title, counts, classes) => {
  const names = classes?.length === counts.length ? classes.map(asText) : counts.map((_, place) => String(place));
  const head = make("tr", {}, make("th", {}, "true"), ...names.map((name) => make("th", { scope: "col" }, `as ${name}`)));
  const body = counts.map((line, place) => make("tr", {}, make("th", { scope: "row" }, names[place]),
    ...[].concat(line).map((count) => make("td", { class: "number" }, asText(count)))));
  return make("table", {}, make("caption", {}, title), make("thead", {}, head), make("tbody", {}, ...body));
};

const isRecord = (value) => value !== null && typeof value === "object" && !Array.isArray(value);

const shownAs = (title, value, classes) => {
  if (value === null || value === undefined || value === "") return [];
  if (title === board.head.titles.confusion && Array.isArray(value)) return [crossed(title, value, classes)];
  if (isRecord(value)) return pairs(title, Object.entries(value).map(([name, one]) => [name, asText(one)]));
  if (!Array.isArray(value)) return pairs(title, [[title, asText(value)]]);
  if (!value.length) return [];
  if (value.every(isRecord)) return [records(title, value)];
  return [make("div", {}, make("p", { class: "caption" }, title),
    make("ul", {}, ...value.map((one) => make("li", {}, asText(one)))))];
};

// A name as one word of a shell; none where no shell should be given it.
const quoted = (name) => {
  if (visible(name) !== name || /[\n\t]/.test(name)) return null;
  return /^[A-Za-z0-9_./:=,@%+-]+$/.test(name) ? name : `'${name.replace(/'/g, `'"'"'`)}'`;
};

const commands = (name) => {
  const word = quoted(name);
  if (word === null) return [make("p", { class: "missing" }, "Its name holds what no command line should be given.")];
  return [make("pre", { class: "commands" }, `tactbench why ${word}\ntactbench rerun ${word}`)];
};

const provenanceOf = (row) => {
  const all = board.head.provenance;
  const made = board.field("made_by", row), host = board.field("host", row);
  const named = all.findIndex(([id]) => made && id === made);
  if (named >= 0) return named;
  // Rows of another version may not say which run made them: the only one of their host did.
  const there = all.map((_, place) => place).filter((place) => host && all[place][1].host === host);
  return !made && there.length === 1 ? there[0] : -1;
};

const provenanceTables = (entry) => {
  const single = Object.entries(entry).filter(([, value]) => !isRecord(value)).map(([name, value]) => [name, asText(value)]);
  const nested = Object.entries(entry).filter(([, value]) => isRecord(value));
  return [...pairs("Run", single),
    ...nested.map(([name, value]) => make("details", {}, make("summary", {}, name), ...shownAs(name, value)))];
};

const isEmpty = (value) => value === null || value === undefined || value === "" ||
  (typeof value === "object" && !Object.keys(value).length);

const cellBody = (row) => {
  const { head, columns } = board;
  const line = columns.map((one) => [one.name, one.column.text(row)])
    .filter(([name, text]) => text && text !== ABSENT);
  const single = (name) => {
    const value = board.raw(name, row);
    return isEmpty(value) || typeof value === "object" ? [] : [[name, asText(value)]];
  };
  const grouped = new Set(Object.values(head.groups).flat());
  const apart = new Set(["traceback", "log", "classes", ...Object.keys(head.titles)]);
  const others = head.fields.filter((name) => !grouped.has(name) && !apart.has(name));
  const parts = [...pairs("As the table shows it", line)];
  for (const [title, names] of Object.entries(head.groups)) parts.push(...pairs(title, names.flatMap(single)));
  parts.push(...pairs("Also", others.flatMap(single)));
  const classes = board.raw("classes", row);
  for (const [name, title] of Object.entries(head.titles)) {
    const value = board.raw(name, row);
    if (!isEmpty(value)) parts.push(...shownAs(title, value, classes));
  }
  for (const name of others) {
    const value = board.raw(name, row);
    if (!isEmpty(value) && typeof value === "object") parts.push(...shownAs(name, value));
  }
  return parts;
};

const longText = (title, text) =>
  isEmpty(text) ? [] : [make("h3", {}, title), make("pre", { tabindex: 0, class: "log" }, asText(text))];

const openCell = (row) => {
  const { head } = board;
  const name = board.field("cell", row), status = board.field("status", row), key = board.field("key", row);
  const dialog = byId("cell");
  const made = provenanceOf(row);
  const missing = head.leftOut.length
    ? [make("p", { class: "note" }, ...prose(`This page is kept small: of each cell it leaves out ${head.leftOut.map((one) =>
      `\`${one}\``).join(", ")}. They are in the cell's own file.`))] : [];
  const file = key
    ? [make("p", { class: "note" }, ...prose(`Its own file in the result folder, with every answer: \`cells/${key}${
      key.length < 64 ? "…" : ""}.h5\`.`))] : [];
  dialog.replaceChildren(
    make("header", {},
      make("h2", { id: "cell-title" }, name),
      make("button", { type: "button", class: "close", "aria-label": "Close", onclick: () => dialog.close() }, "×")),
    make("p", { class: "note" }, head.blocks[board.blockOf[row]]?.title ?? ""),
    make("div", { class: `ended ${status === "done" ? "good" : "bad"}` }, make("strong", {}, status || "?"),
      status === "done" ? "" : `: ${board.field("reason", row)}`),
    ...commands(name),
    ...longText("Traceback", board.raw("traceback", row)),
    ...longText("What the cell printed", board.raw("log", row)),
    make("div", { class: "tables" }, ...cellBody(row)),
    make("h3", {}, "Made by"),
    ...(made >= 0 ? provenanceTables(head.provenance[made][1])
      : [make("p", { class: "note" }, "This page was given no provenance of the run that made this cell.")]),
    ...file, ...missing);
  if (!dialog.open) dialog.showModal();
  dialog.scrollTop = 0;
};

// A number, and the way to its cell. One number a line is on the keyboard's way: all of a line lead to one cell.
const link = (row, text, onTheWay) => {
  const attributes = { href: `#cell=${address(board.field("cell", row))}` };
  if (!onTheWay) attributes.tabindex = -1;
  return make("a", attributes, text);
};

const follow = () => {
  const dialog = byId("cell");
  if (!location.hash.startsWith("#cell=")) {
    if (dialog.open) dialog.close();
    const view = /^#view=(\w+)$/.exec(location.hash);
    if (view) show(view[1]);
    return;
  }
  const wanted = location.hash.slice("#cell=".length);
  board.rowAt ??= new Map(Array.from(board.order, (row) => [address(board.field("cell", row)), row]));
  let row = board.rowAt.get(wanted);
  if (row === undefined) {
    try { row = board.rowAt.get(decodeURIComponent(wanted)); } catch { row = undefined; }
  }
  if (row === undefined) say(`This board has no cell ${wanted}.`);
  else openCell(row);
};
