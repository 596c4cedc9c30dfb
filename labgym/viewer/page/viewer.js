// The page of the viewer: the scene in three.js (the global THREE), the figures, and the keys of a person who drives.

import { Plan } from './plan.js';

const element = (id) => document.getElementById(id);
const MEMORY = 0.07; // seconds in which the drawn robot follows the received pose
const REPEAT = 150; // milliseconds between two commands while a key is down
const KEYS = { ArrowUp: [1, 0], KeyW: [1, 0], ArrowDown: [-1, 0], KeyS: [-1, 0], ArrowLeft: [0, 1], KeyA: [0, 1], ArrowRight: [0, -1], KeyD: [0, -1] };
const CHOICES = { episode: 0, episodes: [], person: false };

// ---- The scene. Its group `room` has the frame of the layout: x right, y away, z up; meters.
const canvas = element('scene');
const renderer = new THREE.WebGLRenderer({ canvas, antialias: true, powerPreference: 'high-performance' });
const probe = renderer.getContext(), naming = probe.getExtension('WEBGL_debug_renderer_info');
const software = /swiftshader|llvmpipe|software/i.test(probe.getParameter(naming ? naming.UNMASKED_RENDERER_WEBGL : probe.RENDERER));
const fine = !software || new URLSearchParams(location.search).has('fine'); // without a graphics card there are no shadows
renderer.toneMapping = THREE.NeutralToneMapping;
renderer.shadowMap.enabled = fine;
renderer.shadowMap.type = THREE.PCFShadowMap;
renderer.shadowMap.autoUpdate = false;
const scene = new THREE.Scene();
scene.background = new THREE.Color('#dfe4e8');
scene.environment = new THREE.PMREMGenerator(renderer).fromScene(new THREE.RoomEnvironment(), 0.04).texture;
scene.environmentIntensity = 0.5;
const sun = new THREE.DirectionalLight('#fff6e8', 1.9);
sun.castShadow = true;
sun.shadow.mapSize.set(2048, 2048);
sun.shadow.bias = -0.0004;
sun.shadow.normalBias = 0.02;
scene.add(sun, sun.target, new THREE.HemisphereLight('#ffffff', '#b9b4aa', 0.75));
const room = new THREE.Group(), laboratory = new THREE.Group(), robot = new THREE.Group(), marks = new THREE.Group();
room.rotation.x = -Math.PI / 2;
scene.add(room, laboratory, robot);
room.add(marks);
const camera = new THREE.PerspectiveCamera(50, 1, 0.05, 200);
const orbit = new THREE.OrbitControls(camera, canvas);
orbit.maxPolarAngle = 0.49 * Math.PI;
orbit.enableDamping = true;

const hits = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({ color: '#00b7b7', size: 0.07 }));
hits.frustumCulled = false;
const fan = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({ color: '#00b7b7', transparent: true, opacity: 0.1, depthWrite: false, side: THREE.DoubleSide }));
fan.frustumCulled = false;
const way = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({ color: '#d97706' }));
way.frustumCulled = false;
const shade = new THREE.Mesh(new THREE.CircleGeometry(0.34, 40), new THREE.MeshBasicMaterial({ color: '#000000', transparent: true, opacity: 0.3, depthWrite: false }));
shade.position.z = 0.006;
room.add(hits, fan, way, shade);

const plan = new Plan(element('plan'));
const crowd = new THREE.Group(), shapes = new Map(), figuresOf = [];
scene.add(crowd);
let episode = null, moment = null, drawn = null, trail = [], lidarPoints = [], shownAttempt = -1, loading = null, mode = 'follow', paused = false;

const loadGlb = async (url) => {
  const answer = await fetch(url);
  if (!answer.ok) throw new Error(await answer.text());
  return new THREE.GLTFLoader().parseAsync(await answer.arrayBuffer(), '');
};

// Return the meshes of a glTF scene, merged by material: a few dozen draw calls in place of a thousand.
function merged(gltf) {
  const groups = new Map();
  gltf.scene.updateMatrixWorld(true);
  gltf.scene.traverse((node) => {
    if (!node.isMesh) return;
    const names = Object.keys(node.geometry.attributes).sort().join();
    const key = `${node.material.name}|${names}|${Boolean(node.geometry.index)}`;
    if (!groups.has(key)) groups.set(key, { material: node.material, parts: [] });
    groups.get(key).parts.push(node.geometry.clone().applyMatrix4(node.matrixWorld));
  });
  return [...groups.values()].map(({ material, parts }) => {
    const mesh = new THREE.Mesh(THREE.mergeGeometries(parts), material);
    return mesh;
  });
}

// Return a flat band along points, slightly above the floor.
function band(points, width, height) {
  const positions = [], index = [];
  points.forEach(([x, y], i) => {
    const [ax, ay] = points[Math.max(i - 1, 0)], [bx, by] = points[Math.min(i + 1, points.length - 1)];
    const length = Math.hypot(bx - ax, by - ay) || 1, nx = (-(by - ay) / length) * width / 2, ny = ((bx - ax) / length) * width / 2;
    positions.push(x + nx, y + ny, height, x - nx, y - ny, height);
    if (i) index.push(2 * i - 2, 2 * i - 1, 2 * i, 2 * i, 2 * i - 1, 2 * i + 1);
  });
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(positions), 3));
  geometry.setIndex(index);
  return geometry;
}

function release(group) {
  for (const node of [...group.children]) {
    group.remove(node);
    node.geometry.dispose();
  }
}

async function load(number) {
  loading = number;
  document.body.dataset.scene = 'loading';
  const answer = await fetch(`episode/${number}.json`);
  if (!answer.ok) throw new Error(await answer.text());
  const next = await answer.json();
  if (loading !== number) return;
  if (!episode || episode.layout !== next.layout) {
    say('Loading the laboratory …');
    const gltf = await loadGlb(`episode/${number}.glb`);
    if (loading !== number) return;
    release(laboratory);
    laboratory.add(...merged(gltf));
    for (const mesh of laboratory.children) mesh.castShadow = mesh.receiveShadow = !mesh.material.transparent;
    light(next.bounds);
  }
  episode = next;
  element('name').textContent = next.label;
  element('protocol').textContent = next.protocol;
  element('shortest').textContent = next.shortest === null ? 'none' : `${next.shortest.toFixed(1)} m`;
  plan.load(next);
  CHOICES.episode = number;
  mark(next);
  place();
  element('episode').value = String(number);
  document.body.dataset.meshes = laboratory.children.length;
  document.body.dataset.scene = 'ready';
  send({ loaded: number });
  announce();
}

// What moves besides the robot: each body is a group with the meshes of its shape, which episodes share.
function shapeOf(number) {
  if (!shapes.has(number)) shapes.set(number, loadGlb(`shape/${number}.glb`).then(merged));
  return shapes.get(number);
}

function stand(bodies) {
  bodies.forEach(([number, x, y, yaw], i) => {
    let body = figuresOf[i];
    if (!body || body.number !== number) {
      if (body) crowd.remove(body.group);
      body = figuresOf[i] = { number, group: new THREE.Group(), pose: [x, y, yaw], target: [x, y, yaw] };
      crowd.add(body.group);
      const { group } = body;
      shapeOf(number).then((meshes) => group.add(...meshes.map((mesh) => new THREE.Mesh(mesh.geometry, mesh.material)))).catch(() => {});
    }
    if (Math.hypot(x - body.pose[0], y - body.pose[1]) > 1) body.pose = [x, y, yaw];
    body.target = [x, y, yaw];
  });
  for (const gone of figuresOf.splice(bodies.length)) crowd.remove(gone.group);
}

function moveCrowd(share) {
  for (const { group, pose, target } of figuresOf) {
    const turn = target[2] - pose[2];
    pose[0] += share * (target[0] - pose[0]);
    pose[1] += share * (target[1] - pose[1]);
    pose[2] += share * Math.atan2(Math.sin(turn), Math.cos(turn));
    group.position.set(pose[0], 0, -pose[1]);
    group.rotation.y = pose[2];
  }
}

function light([x0, y0, x1, y1]) {
  const x = (x0 + x1) / 2, y = (y0 + y1) / 2, reach = Math.hypot(x1 - x0, y1 - y0) / 2 + 1;
  sun.target.position.set(x, 0, -y);
  sun.position.set(x - 0.42 * reach, 1.9 * reach, -y + 0.5 * reach);
  Object.assign(sun.shadow.camera, { left: -reach, right: reach, top: reach, bottom: -reach, near: 0.1, far: 5 * reach });
  sun.shadow.camera.updateProjectionMatrix();
  renderer.shadowMap.needsUpdate = true;
}

function mark(of) {
  release(marks);
  // In an episode of several drives the goal changes.
  if (moment && moment.goal && moment.episode === CHOICES.episode) of.goal = moment.goal;
  document.body.dataset.goal = JSON.stringify(of.goal);
  const { goal, path, docks, success_distance: radius } = of;
  const green = new THREE.MeshBasicMaterial({ color: '#2f9e4f', side: THREE.DoubleSide });
  const ring = new THREE.Mesh(new THREE.RingGeometry(radius - 0.04, radius, 64), green);
  ring.position.set(goal[0], goal[1], 0.012);
  const pole = new THREE.Mesh(new THREE.CylinderGeometry(0.018, 0.018, 1.5, 16), green);
  pole.rotation.x = Math.PI / 2;
  pole.position.set(goal[0], goal[1], 0.75);
  marks.add(ring, pole);
  // The heading in which the robot must stand.
  if (docks) marks.add(new THREE.Mesh(band([[goal[0], goal[1]], [goal[0] + 0.5 * Math.cos(goal[2]), goal[1] + 0.5 * Math.sin(goal[2])]], 0.05, 0.013), green));
  if (path.length > 1) marks.add(new THREE.Mesh(band(path, 0.06, 0.009), new THREE.MeshBasicMaterial({ color: '#0f6fb5', side: THREE.DoubleSide, transparent: true, opacity: 0.7 })));
}

// ---- Cameras.
function place() {
  if (!episode) return;
  const [x0, y0, x1, y1] = episode.bounds, x = (x0 + x1) / 2, y = (y0 + y1) / 2;
  orbit.enabled = mode !== 'follow';
  if (mode === 'follow') return;
  const tall = Math.tan((camera.fov * Math.PI) / 360), across = tall * camera.aspect;
  orbit.target.set(x, mode === 'above' ? 0 : 0.6, -y);
  if (mode === 'above') {
    const distance = Math.max((y1 - y0) / 2 / tall, (x1 - x0) / 2 / across) * 1.25 + 1;
    camera.position.set(x, distance, -y + 0.01);
  } else {
    const distance = Math.max((x1 - x0) / 2 / across, (y1 - y0) / 2 / tall) * 1.3 + 2;
    camera.position.set(x + 0.28 * distance, 0.86 * distance, -y + 0.58 * distance);
  }
  orbit.update();
}

const eye = new THREE.Vector3(), look = new THREE.Vector3(), gaze = new THREE.Vector3();
function follow(seconds, jump) {
  const [x, y, yaw] = drawn;
  eye.set(x - 2.5 * Math.cos(yaw), 3.0, -(y - 2.5 * Math.sin(yaw)));
  look.set(x + 0.9 * Math.cos(yaw), 0.45, -(y + 0.9 * Math.sin(yaw)));
  const share = jump ? 1 : 1 - Math.exp(-seconds / 0.35);
  camera.position.lerp(eye, share);
  gaze.lerp(look, share);
  camera.lookAt(gaze);
}

// ---- The stream of the drive.
function receive(next) {
  moment = next;
  if (next.episode !== CHOICES.episode || !episode) {
    if (loading !== next.episode) load(next.episode).catch((error) => say('The laboratory cannot be shown', error.message, 'bad'));
  }
  if (next.attempt !== shownAttempt) {
    shownAttempt = next.attempt;
    trail = [];
    drawn = null;
  }
  paused = next.paused;
  if (episode && next.episode === CHOICES.episode && next.goal && String(next.goal) !== String(episode.goal)) mark(episode);
  const [x, y, yaw] = next.pose, last = trail[trail.length - 1];
  if (!last || Math.hypot(x - last[0], y - last[1]) > 0.03) trail.push([x, y]);
  const rays = next.lidar.length, positions = [], rim = [];
  lidarPoints = [];
  next.lidar.forEach((range, i) => {
    const angle = yaw - Math.PI + (2 * Math.PI * i) / rays, px = x + range * Math.cos(angle), py = y + range * Math.sin(angle);
    rim.push(px, py, 0.25);
    if (range >= 9.99) return;
    lidarPoints.push([px, py]);
    positions.push(px, py, 0.25);
  });
  hits.geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(positions), 3));
  const index = [];
  for (let i = 0; i < rays; i++) index.push(rays, i, (i + 1) % rays);
  fan.geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array([...rim, x, y, 0.25]), 3));
  fan.geometry.setIndex(index);
  if (trail.length > 1) {
    way.geometry.dispose();
    way.geometry = band(trail, 0.07, 0.014);
  }
  way.visible = trail.length > 1;
  stand(next.bodies);
  document.body.dataset.bodies = next.bodies.length;
  figures(next);
}

function figures(m) {
  element('distance').textContent = `${m.distance.toFixed(2)} m`;
  element('driven').textContent = `${m.path_length.toFixed(2)} m`;
  element('time').textContent = `${m.time.toFixed(1)} s`;
  element('clearance').textContent = `${m.clearance.toFixed(2)} m`;
  element('contacts').textContent = String(m.contacts);
  element('contacts').className = m.touching ? 'touching' : '';
  element('color').src = `data:image/png;base64,${m.color}`;
  element('depth').src = `data:image/png;base64,${m.depth}`;
  element('pause').textContent = paused ? 'Go on' : 'Pause';
  document.body.dataset.pose = JSON.stringify(m.pose);
  document.body.dataset.driven = m.path_length;
  document.body.dataset.phase = m.phase;
  announce();
}

// ---- The card in the middle.
function say(headline, words = '', tone = '', choices = false) {
  const card = element('card');
  card.hidden = headline === '';
  card.className = `panel ${tone}`;
  element('headline').textContent = headline;
  element('words').textContent = words;
  element('choices').hidden = !choices;
}

function announce() {
  if (document.body.dataset.scene !== 'ready' || !moment) return;
  if (moment.phase === 'ready') return say('Your turn', `Drive to the green ring with the arrow keys or W A S D. ${'docks' in episode ? 'Press Enter when you have arrived: STOP. ' : ''}The clock starts with the first key.`);
  if (moment.phase !== 'finished') return say(paused ? 'Paused' : '');
  const r = moment.result, spl = r.spl === undefined || r.spl === null ? '' : `SPL ${r.spl.toFixed(3)}, `;
  const words = r.words ?? `${spl}${r.contacts} contacts, ${r.path_length.toFixed(2)} m in ${r.time.toFixed(1)} s${r.error ? `; ${r.error}` : ''}`;
  return say(r.success ? 'Goal reached' : `Not reached: ${r.final_distance.toFixed(2)} m away`, words, r.success ? 'good' : 'bad', true);
}

// ---- Commands.
const send = (command) =>
  fetch('command', { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(command) }).catch(() => {});
const start = (number) => send({ episode: (number + CHOICES.episodes.length) % CHOICES.episodes.length, paused: false });
const down = new Set();
let commanded = false;
function drive() {
  if (!CHOICES.person) return;
  let forward = 0, turn = 0;
  for (const key of down) {
    forward += KEYS[key][0];
    turn += KEYS[key][1];
  }
  const active = down.size > 0;
  if (active || commanded) send({ forward: Math.max(-1, Math.min(1, forward)), turn: Math.max(-1, Math.min(1, turn)) * 0.6 });
  commanded = active;
}
setInterval(() => down.size && drive(), REPEAT);
const pause = () => {
  paused = !paused;
  element('pause').textContent = paused ? 'Go on' : 'Pause';
  send({ paused });
  announce();
};
const view = (name) => {
  mode = name;
  element('camera').value = name;
  place();
};
addEventListener('keydown', (event) => {
  if (event.target.tagName === 'SELECT' || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.code in KEYS && CHOICES.person) {
    event.preventDefault();
    if (!down.has(event.code)) {
      down.add(event.code);
      drive();
    }
  } else if (event.repeat || event.target.tagName === 'BUTTON') return;
  else if (event.code === 'Enter' && CHOICES.person) send({ stop: true });
  else if (event.code === 'Space') pause();
  else if (event.code === 'KeyR') start(CHOICES.episode);
  else if (event.code === 'KeyN') start(CHOICES.episode + 1);
  else if (event.code === 'KeyP') start(CHOICES.episode - 1);
  else if (event.code === 'KeyC') view({ follow: 'overview', overview: 'above', above: 'follow' }[mode]);
});
addEventListener('keyup', (event) => down.delete(event.code) && drive());
addEventListener('blur', () => {
  down.clear();
  drive();
});
for (const button of element('pad').children) {
  const set = (pressed) => (event) => {
    event.preventDefault();
    pressed ? down.add(button.dataset.key) : down.delete(button.dataset.key);
    drive();
  };
  button.addEventListener('pointerdown', set(true));
  for (const end of ['pointerup', 'pointercancel', 'pointerleave']) button.addEventListener(end, set(false));
}
element('pause').onclick = pause;
element('restart').onclick = element('again').onclick = () => start(CHOICES.episode);
element('next').onclick = element('onward').onclick = () => start(CHOICES.episode + 1);
element('previous').onclick = () => start(CHOICES.episode - 1);
element('episode').onchange = (event) => start(Number(event.target.value));
element('speed').onchange = (event) => send({ speed: Number(event.target.value) });
element('camera').onchange = (event) => view(event.target.value);

// ---- Drawing; without a graphics card fewer pixels are drawn.
let ratio = fine ? Math.min(devicePixelRatio, 2) : 0.75, slow = 0, before = performance.now();
function resize() {
  renderer.setPixelRatio(ratio);
  renderer.setSize(innerWidth, innerHeight, false);
  camera.aspect = innerWidth / innerHeight;
  camera.fov = camera.aspect < 1 ? 64 : 50;
  camera.updateProjectionMatrix();
  place();
}
addEventListener('resize', resize);

function frame(now) {
  const seconds = Math.min((now - before) / 1000, 0.25);
  before = now;
  slow = seconds > 0.07 ? slow + 1 : Math.max(slow - 1, 0);
  if (slow > 12 && ratio > 0.6 && !location.search) {
    ratio = Math.max(0.5, ratio * 0.75);
    slow = 0;
    resize();
  }
  if (moment && episode) {
    const jump = drawn === null, share = jump ? 1 : 1 - Math.exp(-seconds / MEMORY);
    if (jump) drawn = [...moment.pose];
    const turn = moment.pose[2] - drawn[2];
    drawn[0] += share * (moment.pose[0] - drawn[0]);
    drawn[1] += share * (moment.pose[1] - drawn[1]);
    drawn[2] += share * Math.atan2(Math.sin(turn), Math.cos(turn));
    robot.position.set(drawn[0], 0, -drawn[1]);
    robot.rotation.y = drawn[2];
    shade.position.set(drawn[0], drawn[1], 0.006);
    if (mode === 'follow') follow(seconds, jump);
    moveCrowd(share);
    plan.draw(drawn, lidarPoints, trail, moment.people);
  }
  if (mode !== 'follow') orbit.update();
  renderer.render(scene, camera);
  document.body.dataset.triangles = renderer.info.render.triangles;
  requestAnimationFrame(frame);
}

async function begin() {
  resize();
  const [program, body] = await Promise.all([fetch('episodes.json').then((answer) => answer.json()), loadGlb('robot.glb')]);
  robot.add(...merged(body));
  Object.assign(CHOICES, program, { episode: -1 });
  element('episode').append(...program.episodes.map((label, number) => new Option(label, String(number))));
  document.title = `${program.driver}: labgym viewer`;
  element('pad').hidden = !(program.person && matchMedia('(pointer: coarse)').matches);
  const events = new EventSource('events');
  events.onmessage = (event) => receive(JSON.parse(event.data));
  events.onerror = () => say('No connection', 'The command on this machine has ended, or is starting again.', 'bad');
  requestAnimationFrame(frame);
}
begin().catch((error) => say('The viewer cannot start', error.message, 'bad'));
