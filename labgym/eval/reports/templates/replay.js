// The scene of an episode in three.js, which the page loads with the first episode that it shows. Lengths are meters here.
'use strict';
const REPLAYS = 'replays/';
const loaded = new Map();

// Scripts of replays call this: a page that was opened from a file cannot fetch data.
window.labgymReplay = (name, content) => loaded.get(name).resolve(content);

function addScript(address, failed) {
  const script = document.createElement('script');
  script.src = REPLAYS + address;
  script.addEventListener('error', () => failed(new Error(`${REPLAYS}${address} is missing: copy the folder ${REPLAYS} together with this page`)));
  document.head.append(script);
  return script;
}

function loadData(name) {
  if (!loaded.has(name)) {
    const entry = {};
    entry.promise = new Promise((resolve, reject) => Object.assign(entry, { resolve, reject }));
    loaded.set(name, entry);
    addScript(`${name}.js`, (error) => { loaded.delete(name); entry.reject(error); });
  }
  return loaded.get(name).promise;
}

let renderer = null;
function loadThree() {
  renderer = renderer || new Promise((resolve, reject) => addScript('three.min.js', reject).addEventListener('load', resolve));
  return renderer;
}

// ---- Shapes.

function bytesOf(text, kind) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return new kind(bytes.buffer);
}

// Parts of a shape: color, opacity, vertices in meters and indices.
const decoded = new Map();
function partsOf(name, { low, step, parts }) {
  if (!decoded.has(name)) {
    decoded.set(name, parts.map(([color, opacity, packedVertices, packedFaces]) => {
      const steps = bytesOf(packedVertices, Uint16Array), vertices = new Float32Array(steps.length);
      for (let i = 0; i < steps.length; i++) vertices[i] = low[i % 3] + step[i % 3] * steps[i];
      return { color, opacity, vertices, index: bytesOf(packedFaces, steps.length / 3 > 65536 ? Uint32Array : Uint16Array) };
    }));
  }
  return decoded.get(name);
}

const materials = new Map();
function materialOf(color, opacity) {
  const key = `${color} ${opacity}`;
  if (!materials.has(key)) materials.set(key, new THREE.MeshLambertMaterial({ color, flatShading: true, transparent: opacity < 1, opacity, depthWrite: opacity === 1 }));
  return materials.get(key);
}

// One mesh for each look of shapes at their poses [name, x, y, z, yaw]: dozens of draw calls instead of a thousand.
function meshesOf(placed, shapes) {
  const groups = new Map();
  for (const [name, ...pose] of placed) {
    for (const part of partsOf(name, shapes.get(name))) {
      const material = materialOf(part.color, part.opacity);
      if (!groups.has(material)) groups.set(material, []);
      groups.get(material).push([part, pose]);
    }
  }
  return [...groups].map(([material, entries]) => {
    const positions = new Float32Array(entries.reduce((sum, [part]) => sum + part.vertices.length, 0));
    const index = new Uint32Array(entries.reduce((sum, [part]) => sum + part.index.length, 0));
    let vertex = 0, corner = 0;
    for (const [part, [x, y, z, yaw]] of entries) {
      const c = Math.cos(yaw), s = Math.sin(yaw), first = vertex / 3, from = part.vertices;
      for (let i = 0; i < part.index.length; i++) index[corner++] = first + part.index[i];
      for (let i = 0; i < from.length; i += 3) {
        positions[vertex++] = x + c * from[i] - s * from[i + 1];
        positions[vertex++] = y + s * from[i] + c * from[i + 1];
        positions[vertex++] = z + from[i + 2];
      }
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
    geometry.setIndex(new THREE.BufferAttribute(index, 1));
    return new THREE.Mesh(geometry, material);
  });
}

// ---- What the camera cannot see through, in cubes.

const CUBE = 0.1, HIGHEST = 3.2; // meters

class Obstacles {
  constructor(meshes, [x0, y0, x1, y1]) {
    this.low = [x0 - 0.5, y0 - 0.5, 0];
    this.size = [x1 - x0 + 1, y1 - y0 + 1, HIGHEST].map((length) => Math.ceil(length / CUBE));
    this.full = new Uint8Array(this.size[0] * this.size[1] * this.size[2]);
    for (const { geometry, material } of meshes) if (!material.transparent) this.add(geometry.attributes.position.array, geometry.index.array);
  }

  // Index of the cube at a place; -1, which no array has, outside.
  cube(...place) {
    const [i, j, k] = place.map((value, axis) => Math.floor((value - this.low[axis]) / CUBE)), [nx, ny, nz] = this.size;
    return i < 0 || j < 0 || k < 0 || i >= nx || j >= ny || k >= nz ? -1 : (k * ny + j) * nx + i;
  }

  add(positions, index) {
    const [a, b, c] = [new Float32Array(3), new Float32Array(3), new Float32Array(3)], distance = (p, q) => Math.hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
    for (let t = 0; t < index.length; t += 3) {
      [a, b, c].forEach((corner, k) => { for (let axis = 0; axis < 3; axis++) corner[axis] = positions[3 * index[t + k] + axis]; });
      const n = Math.ceil(Math.max(distance(a, b), distance(b, c), distance(c, a)) / (0.8 * CUBE)) || 1;
      for (let i = 0; i <= n; i++) {
        for (let j = 0; i + j <= n; j++) {
          const u = i / n, v = j / n, w = 1 - u - v;
          this.full[this.cube(u * a[0] + v * b[0] + w * c[0], u * a[1] + v * b[1] + w * c[1], u * a[2] + v * b[2] + w * c[2])] = 1;
        }
      }
    }
  }

  between(from, to) {
    const steps = Math.ceil(2 * Math.hypot(...from.map((value, axis) => to[axis] - value)) / CUBE);
    for (let k = 0; k <= steps; k++) if (this.full[this.cube(...from.map((value, axis) => value + (to[axis] - value) * k / steps))]) return true;
    return false;
  }
}

// ---- The stage: a canvas with the scene of one episode, drawn when something changes.

// Where the camera that follows can be: meters away from the robot and above the floor, and degrees aside from behind it.
const EYES = [[2.3, 2.1], [1.4, 2.6], [0.5, 3.6]], ASIDE = [0, 25, -25, 50, -50, 80, -80, 110, -110, 145, -145, 180];

class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.camera = new THREE.PerspectiveCamera(50, 1, 0.05, 200);
    this.orbit = new THREE.OrbitControls(this.camera, canvas);
    this.orbit.maxPolarAngle = 0.49 * Math.PI;
    this.orbit.addEventListener('change', () => this.draw());
    this.world = new THREE.Scene();
    this.room = new THREE.Group();
    this.room.rotation.x = -Math.PI / 2; // z up, as on the floor
    const sun = new THREE.DirectionalLight('#fff6e8', 1.6);
    sun.position.set(-4, 10, 6);
    this.world.add(this.room, sun, new THREE.HemisphereLight('#ffffff', '#b9b4aa', 1.9));
    this.mode = 'follow';
    new ResizeObserver(() => this.resize()).observe(canvas);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.draw());
  }

  // Show the scene of an episode: the data of its script, and ends and path of the page in centimeters.
  show(scene, shapes, episode, bounds) {
    for (const mesh of this.meshes || []) mesh.geometry.dispose();
    this.room.clear();
    this.bounds = bounds.map((value) => value / 100);
    this.meshes = meshesOf([[scene.building, 0, 0, 0, 0], ...scene.placed], shapes);
    this.obstacles = new Obstacles(this.meshes, this.bounds);
    this.eye = null;
    const body = (name) => {
      const group = new THREE.Group(), meshes = meshesOf([[name, 0, 0, 0, 0]], shapes);
      this.meshes.push(...meshes);
      group.add(...meshes);
      return group;
    };
    this.robot = body(scene.robot);
    this.payload = scene.payload && body(scene.payload.shape);
    this.loaded = (leg) => !scene.payload.legs || scene.payload.legs.includes(leg);
    this.people = scene.people.map((name) => { const group = body(name); group.add(this.shade(0.3)); return group; });
    this.things = scene.things.map(([name, x, y, z, yaw, id]) => { const group = body(name); group.position.z = z; return { group, id, rest: [x, y, yaw] }; });
    this.robot.add(this.shade(0.34));
    if (this.payload) this.robot.add(this.payload);
    this.room.add(...this.meshes.filter((mesh) => !mesh.parent), this.robot, ...this.people, ...this.things.map((thing) => thing.group));
    const green = new THREE.MeshBasicMaterial({ color: '#2f9e4f' }), blue = new THREE.MeshBasicMaterial({ color: '#0f6fb5' });
    for (const [x, y, yaw] of episode.goals) {
      const radius = episode.radius / 100, ring = new THREE.Mesh(new THREE.RingGeometry(radius - 0.04, radius, 64), green);
      ring.position.set(x / 100, y / 100, 0.012);
      this.room.add(ring);
      const ahead = [x / 100 + 0.5 * Math.cos(yaw * Math.PI / 180), y / 100 + 0.5 * Math.sin(yaw * Math.PI / 180)];
      if (episode.dock) this.room.add(this.band([[x / 100, y / 100], ahead], 0.05, 0.013, green));
    }
    const path = [];
    for (let i = 0; i < episode.path.length; i += 2) path.push([episode.path[i] / 100, episode.path[i + 1] / 100]);
    if (path.length > 1) this.room.add(this.band(path, 0.05, 0.009, blue));
    this.turn(this.mode);
  }

  shade(radius) {
    const disc = new THREE.Mesh(new THREE.CircleGeometry(radius, 40), new THREE.MeshBasicMaterial({ color: '#000000', transparent: true, opacity: 0.3, depthWrite: false }));
    disc.position.z = 0.006;
    return disc;
  }

  // A flat band along points, slightly above the floor.
  band(points, width, height, material) {
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
    return new THREE.Mesh(geometry, material);
  }

  // Put the robot, people and things at their poses [x, y, yaw]; null hides one. A shift is at one of its legs.
  move(robot, people, things, leg) {
    const put = (group, pose) => {
      group.visible = pose !== null;
      if (pose) { group.position.x = pose[0]; group.position.y = pose[1]; group.rotation.z = pose[2]; }
    };
    put(this.robot, robot);
    this.people.forEach((group, number) => put(group, people[number] || null));
    for (const { group, id, rest } of this.things) put(group, things.has(id) ? things.get(id) : rest);
    if (this.payload) this.payload.visible = this.loaded(leg);
    this.pose = robot;
    this.draw();
  }

  turn(mode) {
    this.mode = mode;
    const [x0, y0, x1, y1] = this.bounds, x = (x0 + x1) / 2, y = (y0 + y1) / 2;
    this.orbit.enabled = mode !== 'follow';
    if (mode !== 'follow') {
      const tall = Math.tan(this.camera.fov * Math.PI / 360), reach = 1.05 * Math.max((x1 - x0) / 2 / (tall * this.camera.aspect), (y1 - y0) / 2 / tall);
      this.orbit.target.set(x, 0, -y);
      this.camera.position.set(x, mode === 'above' ? reach + 2 : 0.9 * reach, -y + (mode === 'above' ? 0.01 : 0.9 * reach));
      this.orbit.update();
    }
    this.draw();
  }

  // Look at the robot from behind and above, or from the nearest direction from which nothing hides it; return whether
  // the camera has arrived there.
  follow() {
    if (!this.pose) return true;
    const best = this.directions().find(([, ...eye]) => !this.hides(eye)) || [0, ...EYES[0], 0];
    const goal = best.slice(1), now = this.eye || goal, most = [0.06, 0.06, 4];
    this.eye = goal.map((value, k) => now[k] + Math.max(-most[k], Math.min(most[k], value - now[k])));
    const [x, y] = this.pose, [along, across] = this.heading(this.eye[2]);
    const [cx, cy, cz] = this.position(this.eye);
    this.camera.position.set(cx, cz, -cy);
    this.camera.lookAt(x + along, 0.3, -(y + across));
    return this.eye.every((value, k) => value === goal[k]);
  }

  // Candidates [cost, meters away, height, degrees aside], the best first: those near the present one change less.
  directions() {
    const now = this.eye ? this.eye[2] : 0;
    return EYES.flatMap(([away, height], row) => ASIDE.map((aside) => [Math.abs(aside) + Math.abs(aside - now) / 2 + 120 * row, away, height, aside]))
      .sort((one, other) => one[0] - other[0]);
  }

  heading(aside) {
    const angle = this.pose[2] + aside * Math.PI / 180;
    return [Math.cos(angle), Math.sin(angle)];
  }

  position([away, height, aside]) {
    const [along, across] = this.heading(aside);
    return [this.pose[0] - away * along, this.pose[1] - away * across, height];
  }

  // Whether something hides the base or the head of the robot.
  hides(eye) {
    const from = this.position(eye), [along, across] = this.heading(eye[2]);
    return [0.25, 1.1].some((z) => this.obstacles.between(from, [this.pose[0] - 0.3 * along, this.pose[1] - 0.3 * across, z]));
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  draw() {
    if (this.asked) return;
    this.asked = requestAnimationFrame(() => {
      this.asked = 0;
      const arrived = this.mode !== 'follow' || this.follow();
      this.world.background = new THREE.Color(getComputedStyle(document.body).getPropertyValue('--soft').trim());
      this.renderer.render(this.world, this.camera);
      this.canvas.dataset.pose = JSON.stringify(this.pose);
      this.canvas.dataset.triangles = this.renderer.info.render.triangles;
      if (!arrived) this.draw();
    });
  }
}
