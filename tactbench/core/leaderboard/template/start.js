// Opening the page: the data is unpacked, the filters are filled, and the view asked for is drawn.
let board = null;
const ROLES = { rank: "#", sensor: "sensor", estimator: "estimator", score: "score", interval: "95 % interval" };

const say = (text) => {
  const place = byId("trouble");
  place.textContent = visible(text);
  place.hidden = false;
};

const readBoard = async () => {
  const [head, ...read] = await Promise.all(packed().map(inflated));
  const columns = head.columns.map((one, place) => ({ ...one, place, column: readColumn(read[place]) }));
  const fields = new Map(head.fields.map((name, place) => [name, readColumn(read[columns.length + place])]));
  const byName = new Map(columns.map((one) => [one.name, one]));
  const isSilent = ({ column }) => column.dictionary.every((one) => ["", ABSENT].includes(asText(one)));
  const shown = new Uint8Array(head.rows).fill(1), blockOf = new Int32Array(head.rows);
  let start = 0;
  const blocks = head.blocks.map(({ size }) => head.order.slice(start, start += size));
  blocks.forEach((rows, place) => rows.forEach((row) => { blockOf[row] = place; }));
  return {
    head, columns, fields, blockOf, isSilent, shown, visibleColumns: columns.filter((one) => !isSilent(one)),
    kinds: readColumn(head.kinds),
    role: (name) => byName.get(ROLES[name]),
    field: (name, row) => fields.get(name)?.text(row) ?? "",
    raw: (name, row) => fields.get(name)?.raw(row),
    rowsOf: (place) => blocks[place].filter((row) => shown[row]),
  };
};

const ANY = "";
const HARDWARE = ["hardware", "SIM"];
const PICKED = ["sensor", "task", "estimator", "status"];

const fillPicker = (select, entries, wanted) => {
  select.replaceChildren(...entries.map(([value, text]) => make("option", { value }, text)));
  if (entries.some(([value]) => value === wanted)) select.value = wanted;
};

const fillFilters = () => {
  const fill = (name, entries, all = `all (${whole(entries.length)})`) => fillPicker(byId(`pick-${name}`), [[ANY, all], ...entries], ANY);
  for (const name of PICKED) {
    const column = board.fields.get(name);
    const entries = counted(column?.index ?? []).map(([place, count]) => [String(place), asText(column.dictionary[place]), count])
      .sort((one, other) => words.compare(one[1], other[1]));
    fill(name, entries.map(([place, text, count]) => [place, name === "status" ? `${text} (${whole(count)})` : text]));
  }
  fill("block", board.head.blocks.map((block, place) => [String(place), block.title]));
  fill("hardware", HARDWARE.map((one) => [one, one]), "all");
};

const SEARCHED = ["sensor", "task", "status", "reason", "protocol", "split", "rig"];
// Whether a row has a word in one of these texts.
const searched = (term) => {
  const columns = [...SEARCHED.map((name) => board.fields.get(name)), board.role("estimator").column, board.role("sensor").column]
    .filter((column) => column)
    .map(({ dictionary, index }) => [dictionary.map((one) => visible(asText(one)).toLowerCase().includes(term)), index]);
  return (row) => columns.some(([matches, index]) => matches[index[row]]);
};

const filter = () => {
  const { shown, blockOf, head } = board, { find, block, hardware, ...picked } = Object.fromEntries(new FormData(byId("filters")));
  const tests = find.toLowerCase().split(/\s+/).filter((term) => term).map(searched);
  if (block !== ANY) tests.push((row) => blockOf[row] === Number(block));
  if (hardware !== ANY) tests.push((row) => head.blocks[blockOf[row]].simulated === (hardware === "SIM"));
  for (const [name, value] of Object.entries(picked)) {
    if (value !== ANY) tests.push((row) => board.fields.get(name).index[row] === Number(value));
  }
  for (const row of shown.keys()) shown[row] = tests.every((test) => test(row));
  const count = shown.reduce((sum, one) => sum + one, 0), all = head.order.length;
  byId("found").textContent = `${count === all ? "" : `${whole(count)} of `}${whole(all)} cells`;
  state.lines.page = state.matrix.page = 0;
  if (block !== ANY) byId("time-block").value = block;
  redraw();
};

const VIEWS = { tables: drawTables, matrix: drawMatrix, time: drawTime };
const redraw = () => VIEWS[state.view]();

const show = (view) => {
  if (!Object.hasOwn(VIEWS, view)) return;
  state.view = view;
  for (const tab of document.querySelectorAll("#views [role=tab]")) {
    const chosen = tab.dataset.view === view;
    tab.setAttribute("aria-selected", chosen);
    tab.tabIndex = chosen ? 0 : -1;
    byId(`view-${tab.dataset.view}`).hidden = !chosen;
  }
  redraw();
};

const NOTES_AT_FIRST = 40;
const drawNotes = (most) => {
  const { notes } = board.head;
  byId("notes").replaceChildren(...notes.slice(0, most).map((note) => make("li", {}, ...prose(note))));
  if (notes.length > most) byId("notes").append(make("li", {},
    make("button", { type: "button", class: "more", onclick: () => drawNotes(Infinity) }, `All ${whole(notes.length)} notes`)));
  if (!notes.length) byId("notes").append(make("li", {}, "Nothing to note."));
};

const drawProvenance = () => {
  const all = board.head.provenance;
  byId("provenance").replaceChildren(...(all.length ? all.map(([, entry]) => make("details", {},
    make("summary", {}, Object.entries(entry).filter(([, value]) => !isEmpty(value) && !isRecord(value)).slice(0, 6)
      .map(([name, value]) => `${name} ${asText(value)}`).join(" · ")), ...provenanceTables(entry)))
    : [make("p", { class: "note" }, "This page was given no provenance.")]));
};

const listen = () => {
  let waiting = 0;
  const soon = () => { cancelAnimationFrame(waiting); waiting = requestAnimationFrame(filter); };
  byId("filters").addEventListener("input", soon);
  byId("filters").addEventListener("reset", soon);
  byId("axes").addEventListener("input", drawTime);
  const tabs = [...document.querySelectorAll("#views [role=tab]")];
  for (const tab of tabs) {
    tab.addEventListener("click", () => { history.replaceState(null, "", `#view=${tab.dataset.view}`); show(tab.dataset.view); });
    tab.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      const next = tabs[(tabs.indexOf(tab) + step + tabs.length) % tabs.length];
      next.focus();
      next.click();
    });
  }
  const dialog = byId("cell");
  dialog.addEventListener("close", () => {
    if (location.hash.startsWith("#cell=")) history.replaceState(null, "", `#view=${state.view}`);
  });
  dialog.addEventListener("click", (event) => { if (event.target === dialog) dialog.close(); });
  window.addEventListener("hashchange", follow);
  window.addEventListener("resize", () => { if (state.view === "time") requestAnimationFrame(drawTime); });
  const turnTo = (size) => { state.size = size; state.lines.page = 0; if (state.view === "tables") drawTables(); };
  window.addEventListener("beforeprint", () => turnTo(PRINTED));
  window.addEventListener("afterprint", () => turnTo(PAGE));
};

const start = async () => {
  if (typeof DecompressionStream === "undefined") {
    say("This browser cannot unpack the page's data (it has no DecompressionStream; browsers since 2023 do). Tables, if any, are below; all of them are in leaderboard.csv.");
    return;
  }
  try {
    board = await readBoard();
    fillFilters();
    drawNotes(NOTES_AT_FIRST);
    drawProvenance();
    byId("app").hidden = false;
    byId("static").remove();
    listen();
    filter();
    show(state.view);
    follow();
    document.documentElement.dataset.ready = "yes";
  } catch (error) {
    byId("app").hidden = true;
    say(`This page's data cannot be shown: ${error.name}: ${error.message}`);
    throw error;
  }
};
start();
