// The plan of a floor with the robot, its lidar, the shortest path and the way driven.

const INK = '#3c444b', FURNITURE = '#b9c0c6', PATH = '#0f6fb5', TRAIL = '#d97706', GOAL = '#2c7a3f', HIT = '#00a3a3', YIELDS = '#8e63b8', UNSEEING = '#5a2a86';

export class Plan {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext('2d');
    this.episode = null;
  }

  // Show another episode: the answer of /episode/N.json.
  load(episode) {
    const [x0, y0, x1, y1] = episode.bounds, margin = 0.35;
    this.episode = episode;
    this.canvas.width = 480;
    const scale = this.canvas.width / (x1 - x0 + 2 * margin);
    this.canvas.height = Math.max(120, Math.min(560, Math.round((y1 - y0 + 2 * margin) * scale)));
    const tall = this.canvas.height / (y1 - y0 + 2 * margin);
    this.scale = Math.min(scale, tall);
    this.left = (this.canvas.width - (x1 - x0) * this.scale) / 2 - x0 * this.scale;
    this.bottom = (this.canvas.height + (y1 - y0) * this.scale) / 2 + y0 * this.scale;
  }

  draw(pose, lidarPoints, trail, people = []) {
    if (!this.episode) return;
    const c = this.context, e = this.episode;
    c.fillStyle = '#f7f7f4';
    c.fillRect(0, 0, this.canvas.width, this.canvas.height);
    for (const corners of e.furniture) this.polygon(corners, FURNITURE);
    for (const [color, corners] of e.changes ?? []) this.polygon(corners, color);
    for (const corners of e.walls) this.polygon(corners, INK);
    this.line(e.path, PATH, 3, [9, 6]);
    this.line(trail, TRAIL, 3.5, []);
    c.fillStyle = HIT;
    for (const [x, y] of lidarPoints) c.fillRect(this.x(x) - 2, this.y(y) - 2, 4, 4);
    c.strokeStyle = GOAL;
    c.lineWidth = 3;
    c.beginPath();
    c.arc(this.x(e.goal[0]), this.y(e.goal[1]), e.success_distance * this.scale, 0, 2 * Math.PI);
    c.stroke();
    for (const [x, y, yaw, yields] of people) {
      c.fillStyle = yields ? YIELDS : UNSEEING;
      c.beginPath();
      c.arc(this.x(x), this.y(y), Math.max(0.26 * this.scale, 4), 0, 2 * Math.PI);
      c.fill();
      this.line([[x, y], [x + 0.5 * Math.cos(yaw), y + 0.5 * Math.sin(yaw)]], c.fillStyle, 3, []);
    }
    if (!pose) return;
    c.save();
    c.translate(this.x(pose[0]), this.y(pose[1]));
    c.rotate(-pose[2]);
    c.fillStyle = '#0b7a7a';
    c.strokeStyle = '#ffffff';
    c.lineWidth = 2;
    const r = Math.max(0.27 * this.scale, 7);
    c.beginPath();
    c.moveTo(1.35 * r, 0);
    c.lineTo(-0.8 * r, 0.85 * r);
    c.lineTo(-0.8 * r, -0.85 * r);
    c.closePath();
    c.fill();
    c.stroke();
    c.restore();
  }

  x(x) { return this.left + x * this.scale; }
  y(y) { return this.bottom - y * this.scale; }

  trace(points) {
    this.context.beginPath();
    points.forEach(([x, y], i) => (i ? this.context.lineTo(this.x(x), this.y(y)) : this.context.moveTo(this.x(x), this.y(y))));
  }

  polygon(points, color) {
    this.trace(points);
    this.context.closePath();
    this.context.fillStyle = color;
    this.context.fill();
  }

  line(points, color, width, dash) {
    if (points.length < 2) return;
    this.trace(points);
    this.context.strokeStyle = color;
    this.context.lineWidth = width;
    this.context.setLineDash(dash);
    this.context.stroke();
    this.context.setLineDash([]);
  }
}
