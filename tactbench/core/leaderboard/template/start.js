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
  const shown = new Uint8Array(head.rows).fill(1), blockOf = new Int32Array(head.rows).fill(-1);
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
const pickers = { sensor: "sensor", task: "task", estimator: "estimator", status: "status" };

const fillPicker = (select, entries, wanted) => {
  select.replaceChildren(...entries.map(([value, text]) => make("option", { value }, text)));
  if (entries.some(([value]) => value === wanted)) select.value = wanted;
};

const fillFilters = () => {
  const fill = (name, entries, all = `all (${whole(entries.length)})`) => fillPicker(byId(`pick-${name}`), [[ANY, all], ...entries], ANY);
  for (const [name, field] of Object.entries(pickers)) {
    const column = board.fields.get(field), counts = new Map();
    for (const place of column?.index ?? []) counts.set(place, (counts.get(place) ?? 0) + 1);
    const entries = [...counts].map(([place, count]) => [String(place), asText(column.dictionary[place]), count])
      .sort((one, other) => words.compare(one[1], other[1]));
    fill(name, entries.map(([place, text, count]) => [place, name === "status" ? `${text} (${whole(count)})` : text]));
  }
  fill("block", board.head.blocks.map((block, place) => [String(place), block.title]));
  fill("hardware", HARDWARE.map((one) => [one, one]), "all");
};

const SEARCHED = ["sensor", "task", "status", "reason", "protocol", "split", "rig"];
const searched = (term) => {
  const hit = new Uint8Array(board.head.rows);
  const columns = [...SEARCHED.map((name) => board.fields.get(name)), board.role("estimator").column, board.role("sensor").column];
  for (const column of columns) {
    if (!column) continue;
    const matches = column.dictionary.map((one) => visible(asText(one)).toLowerCase().includes(term));
    if (matches.includes(true)) for (let row = 0; row < hit.length; row += 1) if (matches[column.index[row]]) hit[row] = 1;
  }
  return hit;
};

const filter = () => {
  const { shown, blockOf, head } = board;
  shown.fill(1);
  const keep = (test) => { for (let row = 0; row < shown.length; row += 1) if (shown[row] && !test(row)) shown[row] = 0; };
  keep((row) => blockOf[row] >= 0);
  const block = byId("pick-block").value, hardware = byId("pick-hardware").value;
  if (block !== ANY) keep((row) => blockOf[row] === Number(block));
  if (hardware !== ANY) keep((row) => head.blocks[blockOf[row]].simulated === (hardware === "SIM"));
  for (const [name, field] of Object.entries(pickers)) {
    const value = byId(`pick-${name}`).value;
    if (value !== ANY) { const { index } = board.fields.get(field); keep((row) => index[row] === Number(value)); }
  }
  for (const term of byId("find").value.toLowerCase().split(/\s+/).filter((one) => one)) {
    const hit = searched(term);
    keep((row) => hit[row]);
  }
  const count = shown.reduce((sum, one) => sum + one, 0), all = head.order.length;
  byId("found").textContent = `${count === all ? "" : `${whole(count)} of `}${whole(all)} cells`;
  state.page = state.matrixPage = 0;
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
  byId("filters").addEventListener("submit", (event) => event.preventDefault());
  byId("filters").addEventListener("reset", soon);
  byId("axes").addEventListener("input", drawTime);
  byId("axes").addEventListener("submit", (event) => event.preventDefault());
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
  window.addEventListener("beforeprint", () => { state.size = PRINTED; state.page = 0; if (state.view === "tables") drawTables(); });
  window.addEventListener("afterprint", () => { state.size = PAGE; if (state.view === "tables") drawTables(); });
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
