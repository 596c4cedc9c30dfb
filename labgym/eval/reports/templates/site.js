
// Enhances the page: views by address, tables that sort, filters, and the viewer of episodes. All lengths are centimeters.
const data = JSON.parse(document.getElementById('data').textContent);
const byId = (id) => document.getElementById(id);
const all = (selector, root = document) => [...root.querySelectorAll(selector)];
document.documentElement.classList.add('scripted');

// ---- Views: #leaderboard, #tasks, #t-aisle-2 (a task), #policies, #p3 (a policy), #episodes, #e12.p3 (an episode, and one of its drives), ...

const views = all('.view');
const title = document.title;

function show(address) {
  const episode = /^e(\d+)(?:\.p(\d+))?$/.exec(address);
  const target = byId(address);
  const view = episode ? byId('episodes') : (target && target.closest('.view')) || views[0];
  const focused = document.activeElement;
  for (const each of views) each.hidden = each !== view;
  for (const link of all('nav a')) {
    if (link.hash === '#' + view.id) link.setAttribute('aria-current', 'page');
    else link.removeAttribute('aria-current');
  }
  const card = target && target.closest('.policy');
  if (cards[view.id]) choose(view, card ? card.id : byId(cards[view.id]).value);
  if (view.id === 'episodes') openEpisode(episode ? Number(episode[1]) : null, episode && episode[2] ? Number(episode[2]) : null);
  if (target && target.tagName === 'DETAILS') target.open = true;
  if (target && target !== view && target !== card) target.scrollIntoView();
  else window.scrollTo(0, 0);
  if (card && target === card && focused.id !== cards[view.id]) card.focus({ preventScroll: true });
  else if (focused.closest('.view[hidden]')) byId('main').focus({ preventScroll: true });
  document.title = `${view.querySelector('h2').textContent} - ${title}`;
}

document.querySelector('.skip').addEventListener('click', (event) => {
  event.preventDefault();
  byId('main').focus();
});

// Views of which one card is shown at a time, and the lists that choose it.
const cards = { policies: 'which', tasks: 'which-task' };

function choose(view, id) {
  byId(cards[view.id]).value = id;
  for (const each of all('.policy', view)) each.hidden = each.id !== id;
}

// ---- Tables that sort: within each group of rows; a first row of a group that names it stays.

function sortBy(head) {
  const table = head.closest('table'), column = head.cellIndex, kind = head.dataset.sort;
  const first = kind === 'number' ? 'descending' : 'ascending';
  const order = head.ariaSort === first ? (first === 'ascending' ? 'descending' : 'ascending') : first;
  for (const each of head.parentNode.cells) each.removeAttribute('aria-sort');
  head.setAttribute('aria-sort', order);
  const sign = order === 'ascending' ? 1 : -1;
  for (const body of table.tBodies) {
    const rows = [...body.rows].filter((row) => !row.classList.contains('track'));
    const value = (row) => row.cells[column].dataset.value;
    rows.sort((a, b) => {
      const [x, y] = [value(a), value(b)];
      if (kind === 'text') return sign * x.localeCompare(y, 'en', { numeric: true });
      if (x === '' || y === '') return (x === '') - (y === '');
      return sign * (Number(x) - Number(y));
    });
    body.append(...rows);
  }
}
for (const button of all('[data-sort] button')) button.addEventListener('click', () => sortBy(button.parentNode));

const chosen = (name) => (document.querySelector(`input[name="${name}"]:checked`) || { value: '' }).value;

function filterBoard() {
  const track = chosen('track'), kind = chosen('kind');
  for (const body of all('.board tbody')) {
    const rows = all('tr[data-kind]', body);
    for (const row of rows) row.hidden = kind !== '' && row.dataset.kind !== kind;
    body.hidden = (track !== '' && body.dataset.track !== track) || rows.every((row) => row.hidden);
  }
}
for (const input of all('input[name="track"], input[name="kind"]')) input.addEventListener('change', filterBoard);
// A new address that leaves the focus in the list; the hash alone would move it to the card.
for (const id of Object.values(cards).filter(byId)) {
  byId(id).addEventListener('change', () => {
    history.pushState(null, '', '#' + byId(id).value);
    show(byId(id).value);
  });
}

if (byId('pair-of')) {
  const filter = () => {
    const one = byId('pair-of').value, apart = byId('only-apart').checked;
    for (const row of all('.pairs tbody tr')) {
      const has = one === '' || row.dataset.a === one || row.dataset.b === one;
      row.hidden = !has || (apart && row.dataset.apart !== '1');
    }
  };
  byId('pair-of').addEventListener('change', filter);
  byId('only-apart').addEventListener('change', filter);
}

// ---- The viewer of episodes.

const SPACE = 'http://www.w3.org/2000/svg';
const ROBOT = 27, PERSON = 30, NEAR = 34;
const state = { episode: null, time: 0, end: 0, playing: null, drives: [], hidden: new Set(), box: null, whole: null };

function draw(parent, name, attributes, text) {
  const node = document.createElementNS(SPACE, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (text !== undefined) node.textContent = text;
  parent.append(node);
  return node;
}

function write(parent, name, text, className) {
  const node = document.createElement(name);
  node.textContent = text;
  if (className) node.className = className;
  parent.append(node);
  return node;
}

// The y axis of the floor points up, that of the picture down.
const lineOf = (flat) => { let d = ''; for (let i = 0; i < flat.length; i += 2) d += `${i ? 'L' : 'M'}${flat[i]} ${-flat[i + 1]}`; return d; };
const flipped = (path) => path.replace(/(-?\d+) (-?\d+)/g, (_, x, y) => `${x} ${-y}`);

function unpacked(flat, width) {
  const rows = [];
  for (let i = 0; i < flat.length; i += width) rows.push(flat.slice(i, i + width).map((value, k) => value + (i ? rows[i / width - 1][k] : 0)));
  return rows;
}

function keysShown() {
  const task = byId('task').value, who = byId('who').value, how = byId('how').value;
  return data.episodes.map((_, index) => index).filter((index) => {
    const each = data.episodes[index];
    if (task && `${each.task}-${each.level}` !== task) return false;
    return (!who && !how) || each.runs.some((run) => (!who || run.policy === Number(who)) && (!how || run.ending === how));
  });
}

function fillEpisodes(current) {
  const list = byId('episode'), shown = keysShown();
  list.replaceChildren();
  for (const index of shown) {
    const each = data.episodes[index], reached = each.runs.filter((run) => run.ending === 'success').length;
    const option = write(list, 'option', `${each.task} ${each.level}, ${each.floor}, ${each.number} (${reached} of ${each.runs.length} succeed)`);
    option.value = index;
  }
  if (!shown.length) write(list, 'option', 'no such episode').value = '';
  list.disabled = !shown.length;
  if (shown.includes(current)) list.value = current;
  return shown;
}

function openEpisode(index, policy) {
  if (index === null) index = state.episode === null ? 0 : state.episode;
  if (!data.episodes[index]) index = 0;
  if (!keysShown().includes(index)) for (const id of ['task', 'who', 'how']) byId(id).value = '';
  fillEpisodes(index);
  const changed = state.episode !== index;
  state.episode = index;
  if (policy !== null) state.only = policy;
  if (changed || policy !== null) load(data.episodes[index], policy);
}

// ---- The scene in 3D: the drive that is chosen under it, with its people and things.

let stage = null;

function note(words) {
  byId('space-note').textContent = words;
  byId('space-note').hidden = !words;
}

async function load(episode, policy) {
  stop();
  const number = data.episodes.indexOf(episode);
  state.ready = '';
  byId('space').dataset.state = 'loading';
  note('Loading the laboratory …');
  try {
    const scene = await loadData(`episodes/${number}`);
    if (state.episode !== number) return;
    showPlan({ ...episode, runs: episode.runs.map((run) => ({ ...run, ...scene.moves[run.policy] })) }, policy);
    const names = [...new Set([scene.building, scene.robot, ...(scene.payload ? [scene.payload.shape] : []), ...scene.people, ...[...scene.placed, ...scene.things].map((each) => each[0])])];
    const [contents] = await Promise.all([Promise.all(names.map(loadData)), loadThree()]);
    if (state.episode !== number) return;
    stage = stage || new Stage(byId('space'));
    stage.show(scene, new Map(names.map((name, place) => [name, contents[place]])), episode, data.plans[episode.plan].bounds);
    stage.resize();
    state.ready = number;
    byId('space').dataset.state = 'ready';
    note('');
    moveSpace();
  } catch (error) {
    if (state.episode !== number) return;
    if (byId('space').dataset.plan !== episode.key) showPlan(episode, policy);
    byId('space').dataset.state = 'failed';
    note(`The scene cannot be shown: ${error.message}`);
  }
}

const between = (rows, dt, time) => {
  const place = Math.min(time / dt, rows.length - 1), low = Math.floor(place), next = rows[Math.min(low + 1, rows.length - 1)];
  return rows[low].map((value, k) => value + (next[k] - value) * (place - low));
};

const shownInSpace = () => state.drives.find((drive) => String(drive.policy) === byId('crowd').value);

function moveSpace() {
  const drive = shownInSpace(), episode = data.episodes[state.episode];
  byId('again').textContent = (drive && drive.command) || '';
  byId('again').parentNode.hidden = !(drive && drive.command);
  byId('still-things').hidden = !(drive && !drive.things && episode.changes.some(([kind]) => kind === 'movable'));
  if (state.ready !== state.episode) return;
  if (!drive) {
    const [x, y, yaw] = episode.start;
    stage.move([x / 100, y / 100, yaw * Math.PI / 180], [], new Map(), 0);
    return;
  }
  const [x, y, yaw] = poseAt(drive, state.time), people = [], things = new Map();
  if (drive.crowd.length) {
    const { dt } = drive.people, here = between(drive.crowd, dt, state.time), next = between(drive.crowd, dt, state.time + 0.6);
    const before = between(drive.crowd, dt, Math.max(0, state.time - 0.6));
    for (let i = 0; i < here.length; i += 2) people.push([here[i] / 100, here[i + 1] / 100, Math.atan2(next[i + 1] - before[i + 1], next[i] - before[i])]);
  }
  if (drive.things) {
    const places = between(drive.moved, drive.things.dt, state.time);
    drive.things.names.forEach((name, i) => things.set(name, state.time < drive.things.since[i] ? null : [places[3 * i] / 100, places[3 * i + 1] / 100, places[3 * i + 2] / 100]));
  }
  const ends = (drive.legs || []).map((_, k, legs) => legs.slice(0, k + 1).reduce((sum, one) => sum + one[2], 0));
  stage.move([x / 100, y / 100, yaw * Math.PI / 180], people, things, ends.slice(0, -1).filter((end) => end <= state.time).length);
}

function showPlan(episode, policy) {
  byId('space').dataset.plan = episode.key;
  state.drives = episode.runs.map((run) => ({
    ...run,
    name: data.policies[run.policy],
    poses: run.route ? unpacked(run.route.poses, 3) : [],
    crowd: run.people ? unpacked(run.people.places, 2 * run.people.yields.length) : [],
    moved: run.things ? unpacked(run.things.places, 3 * run.things.names.length) : [],
  })).sort((a, b) => !a.poses.length - !b.poses.length);
  const withRoute = state.drives.filter((drive) => drive.poses.length);
  state.hidden = new Set(withRoute.filter((drive, place) => (policy === null ? place >= 6 : drive.policy !== policy)).map((drive) => drive.policy));
  if (policy !== null && !withRoute.some((drive) => drive.policy === policy)) state.hidden = new Set();
  byId('about-episode').textContent = `${episode.task}, level ${episode.level}: ${episode.words}. Shortest path ${episode.length.toFixed(2)} m` +
    (episode.goals.length > 1 ? `, ${episode.goals.length} goals` : '') + goalWords(episode) + `. Episode ${episode.key}.`;
  byId('crowd').replaceChildren();
  for (const drive of withRoute) write(byId('crowd'), 'option', `${drive.name}: ${endingWords(drive)}`).value = drive.policy;
  byId('crowd-choice').hidden = !withRoute.length;
  if (withRoute.some((drive) => drive.policy === policy)) byId('crowd').value = policy;
  drawFloor(episode);
  listRuns();
  listLegend(episode);
  listEquipment(episode);
  setEnd(true);
}

function goalWords(episode) {
  const names = episode.goals.map((goal) => goal[3]).filter((name) => name);
  return names.length ? `; to ${names.join(', ')}` : '';
}

const shownDrives = () => state.drives.filter((drive) => drive.poses.length && !state.hidden.has(drive.policy));

function setEnd(toEnd) {
  state.end = Math.max(0.1, ...shownDrives().map((drive) => drive.route.seconds));
  byId('time').hidden = !state.drives.some((drive) => drive.poses.length);
  byId('clock').max = state.end;
  moveTo(toEnd ? state.end : Math.min(state.time, state.end));
}

function drawFloor(episode) {
  const plan = data.plans[episode.plan], svg = byId('plan'), [x0, y0, x1, y1] = plan.bounds;
  for (const node of all('#plan > g')) node.remove();
  state.whole = [x0 - 30, -y1 - 30, x1 - x0 + 60, y1 - y0 + 60];
  const floor = draw(svg, 'g', {});
  draw(floor, 'path', { class: 'rooms', d: flipped(plan.rooms) });
  for (const [x, y, name, width] of plan.names) draw(floor, 'text', { class: 'space', x, y: -y, 'font-size': Math.max(16, Math.min(40, width / (0.62 * name.length))).toFixed(1) }, name);
  for (const item of plan.items) drawItem(floor, item);
  draw(floor, 'path', { class: 'walls', d: flipped(plan.walls) });
  for (const pane of plan.panes) draw(floor, 'path', { class: 'pane', d: lineOf(pane) });
  for (const [leaf, sweep] of plan.doors) { draw(floor, 'path', { class: 'sweep', d: lineOf(sweep) }); draw(floor, 'path', { class: 'door', d: lineOf(leaf) }); }
  for (const [kind, name, corners] of episode.changes) {
    const shape = draw(floor, 'path', { class: kind, d: lineOf(corners) + (corners.length > 4 ? 'Z' : '') });
    draw(shape, 'title', {}, `${name}: ${CHANGES[kind]}`);
  }
  draw(floor, 'path', { class: 'shortest', d: lineOf(episode.path) });
  draw(floor, 'circle', { class: 'start', cx: episode.start[0], cy: -episode.start[1], r: 16 });
  episode.goals.forEach(([x, y, yaw, name], place) => {
    const disc = draw(floor, 'circle', { class: 'goal', cx: x, cy: -y, r: episode.radius });
    draw(disc, 'title', {}, name ? `Goal: ${name}` : 'Goal');
    if (episode.dock) draw(floor, 'path', { class: 'heading', d: arrow(x, y, yaw, 70) });
    const here = shared(episode.goals, x, y);
    if (episode.goals.length > 1 && here[0] === place) draw(floor, 'text', { class: 'goal-name', x, y: -y, 'font-size': 34 }, here.map((each) => each + 1).join(', '));
  });
  state.moving = draw(svg, 'g', {});
  zoomTo(state.whole);
  byId('plan-title').textContent = `Floor plan of ${episode.floor}`;
}

// The indices of the goals whose numbers would lie on those of a goal at a place.
const shared = (goals, x, y) => goals.map((_, index) => index).filter((index) => Math.hypot(goals[index][0] - x, goals[index][1] - y) < 30);

function arrow(x, y, yaw, length) {
  const at = (along, across) => {
    const turn = yaw * Math.PI / 180, c = Math.cos(turn), s = Math.sin(turn);
    return `${(x + along * c - across * s).toFixed(1)} ${(-(y + along * s + across * c)).toFixed(1)}`;
  };
  return `M${at(0, 0)}L${at(length, 0)}M${at(length - 22, 14)}L${at(length, 0)}L${at(length - 22, -14)}`;
}

function drawItem(parent, [x, y, width, depth, yaw, kind, store, name, contents]) {
  const item = draw(parent, 'g', { transform: `translate(${x} ${-y}) rotate(${-yaw})` });
  draw(item, 'rect', { class: `item ${kind}`, x: -width / 2, y: -depth / 2, width, height: depth });
  const front = { class: store ? `store s-${store.split(' ')[0]}` : 'front', d: `M${-width / 2} ${-depth / 2}H${width / 2}` };
  draw(item, 'path', front);
  draw(item, 'title', {}, contents ? `${name}: ${contents}` : name);
  label(parent, x, y, width, depth, yaw, name);
}

// Write a name into a piece of furniture, on up to three lines, in the largest size that fits.
function label(parent, x, y, width, depth, yaw, name) {
  const turned = Math.abs(Math.round(yaw / 90)) % 2 === 1, upright = turned ? width > 1.4 * depth : depth > 1.4 * width;
  const across = Math.max(width, depth) === (turned ? depth : width) ? Math.max(width, depth) : (upright ? Math.max(width, depth) : Math.min(width, depth));
  const high = across === width ? depth : width;
  const words = name.split(' ');
  let best = { size: 0 };
  for (let count = 1; count <= Math.min(3, words.length); count++) {
    const lines = broken(words, count), longest = Math.max(...lines.map((line) => line.length));
    const size = Math.min(22, (across - 8) / (0.56 * longest), (high - 8) / (1.15 * count));
    if (size > best.size + 1) best = { size, lines };
  }
  if (best.size < 11) return;
  const text = draw(parent, 'text', { class: 'label', 'font-size': best.size.toFixed(1), transform: `translate(${x} ${-y})` + (upright ? ' rotate(-90)' : '') });
  best.lines.forEach((line, place) => draw(text, 'tspan', { x: 0, y: ((place - (best.lines.length - 1) / 2) * 1.1 * best.size).toFixed(1) }, line));
}

function broken(words, count) {
  const lines = [], goal = words.join(' ').length / count;
  let line = '';
  words.forEach((word, place) => {
    const longer = line ? `${line} ${word}` : word, left = words.length - place;
    if (line && lines.length < count - 1 && (longer.length > goal + 2 || left < count - lines.length)) { lines.push(line); line = word; } else line = longer;
  });
  lines.push(line);
  return lines;
}

// ---- Time.

function poseAt(drive, time) {
  const last = drive.poses.length - 1, place = Math.min(time / drive.route.dt, last), low = Math.floor(place);
  if (low >= last || time >= drive.route.seconds) return drive.poses[last];
  return drive.poses[low].map((value, k) => value + (drive.poses[low + 1][k] - value) * (place - low));
}

function moveTo(time) {
  state.time = Math.max(0, Math.min(time, state.end));
  const clock = byId('clock');
  clock.value = state.time;
  byId('now').textContent = `${state.time.toFixed(1)} s`;
  clock.setAttribute('aria-valuetext', `${state.time.toFixed(1)} of ${state.end.toFixed(1)} seconds`);
  drawMoving();
  moveSpace();
}

function drawMoving() {
  const group = state.moving;
  group.replaceChildren();
  const drives = shownDrives();
  for (const drive of drives) {
    const look = lookOf(drive.policy), points = drive.poses.map(([x, y]) => [x, y]);
    draw(group, 'path', { class: `whole ${look}`, d: lineOf(points.flat()) });
  }
  drawCrowd(group);
  for (const drive of drives) {
    const look = lookOf(drive.policy), [x, y, yaw] = poseAt(drive, state.time);
    const passed = drive.poses.slice(0, Math.floor(state.time / drive.route.dt) + 1).map((pose) => pose.slice(0, 2));
    const line = lineOf([...passed, [x, y]].flat()), done = state.time >= drive.route.seconds;
    draw(group, 'path', { class: 'casing', d: line });
    draw(group, 'path', { class: `driven ${look}`, d: line });
    const robot = draw(group, 'g', { class: `robot ${look}`, transform: `translate(${x.toFixed(1)} ${(-y).toFixed(1)}) rotate(${(-yaw).toFixed(1)})` });
    draw(robot, 'circle', { r: ROBOT });
    draw(robot, 'path', { d: 'M20 0L-13 13L-6 0L-13 -13Z' });
    draw(robot, 'title', {}, `${drive.name}${done ? ': ' + endingWords(drive) : ''}`);
    if (done && drive.ending !== 'success') draw(group, 'path', { class: `cross ${look}`, d: `M${x - 24} ${-y - 24}l48 48m0 -48l-48 48` });
  }
}

function drawCrowd(group) {
  const drive = shownInSpace();
  if (!drive || !drive.crowd.length) return;
  const place = Math.min(state.time / drive.people.dt, drive.crowd.length - 1), low = Math.floor(place), share = place - low;
  const here = drive.crowd[low], next = drive.crowd[Math.min(low + 1, drive.crowd.length - 1)];
  const crowd = draw(group, 'g', { class: state.time > drive.route.seconds ? 'crowd over' : 'crowd' });
  drive.people.yields.forEach((yields, person) => {
    const x = here[2 * person] + (next[2 * person] - here[2 * person]) * share, y = here[2 * person + 1] + (next[2 * person + 1] - here[2 * person + 1]) * share;
    const look = draw(crowd, 'g', { transform: `translate(${x.toFixed(1)} ${(-y).toFixed(1)})` });
    drawPerson(look, yields);
    draw(look, 'title', {}, `Person ${person + 1}, ${yields ? 'makes way' : 'does not see the robot'}`);
  });
}

function drawPerson(parent, yields) {
  draw(parent, 'circle', { class: yields ? 'yields' : 'unseeing', r: PERSON });
  if (!yields) draw(parent, 'path', { class: 'bar', d: 'M-16 0H16' });
}

function stop() {
  if (state.playing !== null) cancelAnimationFrame(state.playing);
  state.playing = null;
  if (byId('play')) byId('play').textContent = 'Play';
}

function play() {
  if (state.time >= state.end) moveTo(0);
  let before = null;
  const frame = (now) => {
    if (before !== null) moveTo(state.time + (now - before) / 1000 * Number(byId('speed').value));
    before = now;
    if (state.time >= state.end) stop();
    else state.playing = requestAnimationFrame(frame);
  };
  state.playing = requestAnimationFrame(frame);
  byId('play').textContent = 'Pause';
}

// ---- Drives, legend and equipment of an episode.

const CHANGES = { added: 'not on the map, or elsewhere on it', movable: 'not on the map, can be pushed', gone: 'on the map only', glass: 'glass, not on the map', shut: 'shut, open on the map', opened: 'open, shut on the map' };
const lookOf = (policy) => data.looks[policy];

function endingWords(drive) {
  return (drive.ending === 'time' ? 'time over' : drive.ending) + (drive.contact ? ` with ${drive.contact}` : '') + (drive.time === undefined ? '' : ` after ${drive.time.toFixed(1)} s`);
}

function listRuns() {
  const list = byId('runs');
  list.replaceChildren();
  for (const drive of state.drives) {
    const item = write(list, 'li', '', drive.poses.length ? '' : 'still'), name = write(item, drive.poses.length ? 'label' : 'div', '', 'name');
    if (drive.poses.length) {
      const box = write(name, 'input', '');
      box.type = 'checkbox';
      box.checked = !state.hidden.has(drive.policy);
      box.addEventListener('change', () => { if (box.checked) state.hidden.delete(drive.policy); else state.hidden.add(drive.policy); setEnd(false); });
    }
    write(name, 'span', drive.name);
    if (drive.poses.length) swatch(name, 'path', { class: `driven ${lookOf(drive.policy)}`, d: 'M3 8H41' }, '0 0 44 16', 44);
    const words = write(item, 'p', '');
    write(words, 'span', endingWords(drive), drive.ending === 'success' ? 'ok' : 'no');
    words.append(`, score ${drive.score.toFixed(2)}` + (drive.driven === undefined ? '' : `, ${drive.driven.toFixed(1)} m driven`) + (drive.poses.length || !state.drives.some((each) => each.poses.length) ? '' : '; no route'));
    if (drive.legs) write(item, 'p', `Drives: ${drive.legs.map(([ending, docked]) => ending + (ending === 'success' && !docked ? ' (out of the dock)' : '')).join(', ')}`);
    if (drive.error) write(item, 'p', drive.error);
    if (drive.film) { const link = write(write(item, 'p', ''), 'a', 'Film'); link.href = drive.film; link.setAttribute('aria-label', `Film of ${drive.name}`); }
  }
  byId('plan-text').textContent = state.drives.map((drive) => `${drive.name}: ${endingWords(drive)}`).join('; ');
}

function swatch(parent, name, attributes, box = '0 0 20 16', width = 20) {
  const svg = draw(parent, 'svg', { viewBox: box, width, height: 16, 'aria-hidden': 'true' });
  draw(svg, name, attributes);
  return svg;
}

function listLegend(episode) {
  const list = byId('legend'), plan = data.plans[episode.plan];
  list.replaceChildren();
  const entry = (words, name, attributes, box) => {
    const item = write(list, 'li', ''), picture = swatch(item, name, attributes, box);
    write(item, 'span', words);
    return picture;
  };
  const area = { x: 1, y: 2, width: 18, height: 12 };
  for (const [kind, words] of Object.entries(data.furniture)) if (plan.items.some((item) => item[5] === kind)) entry(words, 'rect', { ...area, class: kind });
  for (const store of new Set(plan.items.map((item) => item[6]).filter((each) => each))) entry(`Cabinet for ${store}`, 'path', { class: `store s-${store.split(' ')[0]}`, d: 'M0 8H20' });
  for (const kind of new Set(episode.changes.map((change) => change[0]))) {
    const words = CHANGES[kind];
    if (kind === 'shut' || kind === 'opened') entry(`Door: ${words}`, 'path', { class: kind, d: 'M0 8H20' });
    else entry(words[0].toUpperCase() + words.slice(1), 'rect', { ...area, class: kind });
  }
  if (state.drives.some((drive) => drive.crowd.length)) {
    for (const [yields, words] of [[1, 'Person, makes way'], [0, 'Person, does not see the robot']]) {
      const item = write(list, 'li', '');
      drawPerson(draw(item, 'svg', { viewBox: '-34 -34 68 68', width: 20, height: 16, 'aria-hidden': 'true' }), yields);
      write(item, 'span', words);
    }
  }
  entry('Start', 'circle', { class: 'start', cx: 10, cy: 8, r: 4 });
  entry('Goal', 'circle', { class: 'goal', cx: 10, cy: 8, r: 6 });
  entry('Shortest path', 'path', { class: 'shortest', d: 'M0 8H20' });
  if (state.drives.some((drive) => drive.poses.length && drive.ending !== 'success')) entry('Ended there without success', 'path', { class: 'cross r5', d: 'M5 3l10 10m0 -10l-10 10' });
}

function listEquipment(episode) {
  const list = byId('equipment'), lines = new Map();
  list.replaceChildren();
  for (const item of data.plans[episode.plan].items) {
    const key = `${item[7]}\n${item[8]}`;
    lines.set(key, (lines.get(key) || 0) + 1);
  }
  for (const [key, count] of [...lines].sort((a, b) => a[0].localeCompare(b[0], 'en'))) {
    const [name, contents] = key.split('\n'), item = write(list, 'li', count > 1 ? `${name} (${count})` : name);
    if (contents) write(item, 'span', `: ${contents}`);
  }
}

// ---- Zoom and pan.

function zoomTo(box) {
  const svg = byId('plan'), [, , width, height] = state.whole;
  const scale = Math.min(1, Math.max(0.12, box[2] / width));
  const [w, h] = [width * scale, height * scale];
  const x = Math.min(Math.max(box[0], state.whole[0]), state.whole[0] + width - w), y = Math.min(Math.max(box[1], state.whole[1]), state.whole[1] + height - h);
  state.box = [x, y, w, h];
  svg.setAttribute('viewBox', state.box.map((value) => value.toFixed(1)).join(' '));
  svg.classList.toggle('near', scale < 1);
  const pixels = svg.clientWidth / w;
  svg.classList.toggle('far', pixels * 100 < NEAR);
}

function zoomBy(factor) {
  if (!factor) return zoomTo(state.whole);
  const [x, y, w, h] = state.box;
  return zoomTo([x + w * (1 - factor) / 2, y + h * (1 - factor) / 2, w * factor, h * factor]);
}

if (data.episodes.length) {
  const svg = byId('plan');
  for (const button of all('.zoom button')) button.addEventListener('click', () => zoomBy(Number(button.dataset.zoom)));
  svg.addEventListener('keydown', (event) => {
    const [x, y, w, h] = state.box, step = w / 8;
    const moves = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] };
    if (event.key === '+' || event.key === '-') zoomBy(event.key === '+' ? 0.7 : 1.4);
    else if (moves[event.key] && w < state.whole[2]) zoomTo([x + moves[event.key][0], y + moves[event.key][1], w, h]);
    else return;
    event.preventDefault();
  });
  let held = null;
  svg.addEventListener('pointerdown', (event) => { if (svg.classList.contains('near')) { held = [event.clientX, event.clientY, ...state.box]; svg.setPointerCapture(event.pointerId); } });
  svg.addEventListener('pointermove', (event) => {
    if (!held) return;
    const scale = held[4] / svg.clientWidth;
    zoomTo([held[2] - (event.clientX - held[0]) * scale, held[3] - (event.clientY - held[1]) * scale, held[4], held[5]]);
  });
  for (const name of ['pointerup', 'pointercancel']) svg.addEventListener(name, () => { held = null; });
  for (const id of ['task', 'who', 'how']) {
    byId(id).addEventListener('change', () => {
      const shown = fillEpisodes(state.episode);
      if (shown.length && !shown.includes(state.episode)) location.hash = `e${shown[0]}`;
    });
  }
  byId('episode').addEventListener('change', () => { location.hash = `e${byId('episode').value}`; });
  const step = (by) => {
    const shown = keysShown(), place = shown.indexOf(state.episode);
    if (shown.length) location.hash = `e${shown[(place + by + shown.length) % shown.length]}`;
  };
  byId('previous').addEventListener('click', () => step(-1));
  byId('next').addEventListener('click', () => step(1));
  byId('play').addEventListener('click', () => { if (state.playing === null) play(); else stop(); });
  byId('clock').addEventListener('input', () => { stop(); moveTo(Number(byId('clock').value)); });
  byId('crowd').addEventListener('change', () => moveTo(state.time));
  byId('camera').addEventListener('change', () => { if (state.ready === state.episode) { stage.turn(byId('camera').value); moveSpace(); } });
  window.addEventListener('resize', () => { if (state.box) zoomTo(state.box); });
  for (const form of all('form')) form.addEventListener('submit', (event) => event.preventDefault());
}
window.addEventListener('hashchange', () => show(location.hash.slice(1)));
show(location.hash.slice(1));
