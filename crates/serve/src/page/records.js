// The records, and their pages.

import { get, post, may, me } from "/static/server.js";
import { ask, attempt, $ } from "/static/main.js";

let all = [], frames = [];

const address = (folder, file) => `/view/${me().view_key}/${encodeURIComponent(folder)}/${file}`;

function frame(folder, file, title) {
  // Two pages beside each other; the older one goes.
  frames = [...frames.filter((one) => one.key !== `${folder}/${file}`), { key: `${folder}/${file}`, folder, file, title }].slice(-2);
  $("frames").replaceChildren(...frames.map((one) => {
    const outer = document.createElement("div"), heading = document.createElement("h3"), inner = document.createElement("iframe");
    heading.textContent = `${one.folder}: ${one.title}`;
    inner.title = heading.textContent;
    inner.setAttribute("sandbox", "allow-scripts allow-popups allow-downloads");
    inner.src = address(one.folder, one.file);
    outer.append(heading, inner);
    return outer;
  }));
}

function button(text, act) {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = text;
  made.onclick = act;
  return made;
}

async function correct(folder) {
  const path = `/api/records/${encodeURIComponent(folder)}/correction`;
  const { said, lines } = await post(path, { keep: false });
  const question = `${said.join(". ")}. Write this as a new rig file? The present one stays as it is.`;
  if (!await ask(question, "Write", lines.map((line) => `${line.sign} ${line.text}`))) return;
  const { file } = await post(path, { keep: true });
  $("alert").textContent = `Written: ${file}. Serve that file to scan with it.`;
}

/** Asks for a note, and keeps it. */
function note(folder) {
  $("note-about").textContent = `A note about ${folder}`;
  $("note").elements.text.value = "";
  $("note-dialog").showModal();
  $("note-cancel").onclick = () => $("note-dialog").close();
  $("note").onsubmit = (event) => {
    event.preventDefault();
    attempt(async () => {
      await post(`/api/records/${encodeURIComponent(folder)}/notes`, { text: $("note").elements.text.value });
      $("note-dialog").close();
      await opened(null);
    });
  };
}

function list() {
  const wanted = $("search").value.toLowerCase();
  const found = all.filter((record) => `${record.folder} ${record.name} ${record.recorded} ${record.state ?? ""} ${record.notes.map((note) => note.text).join(" ")}`.toLowerCase().includes(wanted));
  $("records").replaceChildren(...found.map((record) => {
    const row = document.createElement("tr"), cell = (content) => { const made = document.createElement("td"); made.append(...[content].flat()); return made; };
    const shows = [];
    if (record.report) shows.push(button("Report", () => frame(record.folder, "report/index.html", "report")));
    if (record.why) shows.push(button("Why", () => frame(record.folder, "report/why/index.html", "why they differ")));
    if (record.why && may("operator")) shows.push(button("Correct the rig file…", () => attempt(() => correct(record.folder))));
    const data = document.createElement("a");
    data.href = address(record.folder, "samples.csv");
    data.download = `${record.folder}.csv`;
    data.textContent = "readings (CSV)";
    shows.push(data);
    const buttons = document.createElement("div");
    buttons.className = "buttons";
    const notes = document.createElement("ul");
    notes.className = "notes";
    notes.append(...record.notes.map((note) => {
      const item = document.createElement("li"), time = document.createElement("time");
      time.dateTime = note.at;
      time.textContent = new Date(note.at).toLocaleDateString();
      item.append(time, ` ${note.who}: ${note.text}`);
      return item;
    }));
    if (may("operator")) shows.push(button("Note…", () => note(record.folder)));
    buttons.replaceChildren(...shows);
    const map = document.createElement("img");
    map.alt = "";
    map.loading = "lazy";
    map.className = "small-map";
    if (record.map) map.src = address(record.folder, `report/${record.map}`);
    map.hidden = !record.map;
    row.append(cell(map), cell([record.folder === record.name ? record.name : `${record.folder} (${record.name})`, notes]), cell(new Date(record.recorded).toLocaleString()), cell(record.state ?? "imported"), cell(buttons));
    return row;
  }));
}

export const opened = (folder) => attempt(async () => {
  all = await get("/api/records");
  list();
  if (folder) frame(folder, "report/index.html", "report");
});

export function begin() {
  $("search").oninput = list;
}
