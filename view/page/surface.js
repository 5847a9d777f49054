
// What is computed of the surface: smooth normals, and the number by which each node is coloured.
function normalsOf(positions, triangles, out) {
  const normals = out ?? new Float32Array(positions.length);
  normals.fill(0);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
    const [ux, uy, uz] = [positions[b] - positions[a], positions[b + 1] - positions[a + 1], positions[b + 2] - positions[a + 2]];
    const [vx, vy, vz] = [positions[c] - positions[a], positions[c + 1] - positions[a + 1], positions[c + 2] - positions[a + 2]];
    // As long as the triangle is large: so it counts as much.
    const [nx, ny, nz] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (const at of [a, b, c]) { normals[at] += nx; normals[at + 1] += ny; normals[at + 2] += nz; }
  }
  for (let at = 0; at < normals.length; at += 3) {
    const length = Math.hypot(normals[at], normals[at + 1], normals[at + 2]) || 1;
    normals[at] /= length; normals[at + 1] /= length; normals[at + 2] /= length;
  }
  return normals;
}

// How far each node has gone into the body (m).
function depths(out) {
  const { positions, rest, restNormals } = state;
  for (let node = 0; node < out.length; node += 1) {
    const at = 3 * node;
    out[node] = (rest[at] - positions[at]) * restNormals[at] + (rest[at + 1] - positions[at + 1]) * restNormals[at + 1] + (rest[at + 2] - positions[at + 2]) * restNormals[at + 2];
  }
}

// Pressure at each node (Pa): the force of each contact along the surface's normal, shared among the corners of its triangle,
// over a third of the area of the triangles around.
function pressures(out, normals, areas) {
  out.fill(0);
  for (const touch of state.touches) {
    const corners = [0, 1, 2].map((n) => state.triangles[3 * touch.triangle + n]);
    if (corners.some((corner) => corner === undefined)) continue;
    const places = corners.map((corner) => [...state.positions.subarray(3 * corner, 3 * corner + 3)]);
    const shares = weights(touch.place, places);
    corners.forEach((corner, n) => {
      const normal = [...normals.subarray(3 * corner, 3 * corner + 3)];
      out[corner] += (shares[n] * Math.max(0, dot(touch.force, normal))) / areas[corner];
    });
  }
}

// Barycentric weights of the foot of a place on a triangle, kept inside.
function weights(place, [a, b, c]) {
  const [u, v, w] = [minus(b, a), minus(c, a), minus(place, a)];
  const [uu, uv, vv, wu, wv] = [dot(u, u), dot(u, v), dot(v, v), dot(w, u), dot(w, v)];
  const determinant = uu * vv - uv * uv || 1;
  const second = Math.max(0, Math.min(1, (vv * wu - uv * wv) / determinant));
  const third = Math.max(0, Math.min(1 - second, (uu * wv - uv * wu) / determinant));
  return [1 - second - third, second, third];
}

// A third of the area of the triangles around each node (m^2).
function areasOf(positions, triangles) {
  const areas = new Float32Array(positions.length / 3);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [0, 1, 2].map((n) => [...positions.subarray(3 * triangles[t + n], 3 * triangles[t + n] + 3)]);
    const third = norm(cross(minus(b, a), minus(c, a))) / 6;
    for (const n of [0, 1, 2]) areas[triangles[t + n]] += third;
  }
  return areas;
}

// The nearest place of the surface in a direction, or null.
function hit(from, direction) {
  const { positions, triangles } = state;
  let nearest = Infinity;
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
    const u = [positions[b] - positions[a], positions[b + 1] - positions[a + 1], positions[b + 2] - positions[a + 2]];
    const v = [positions[c] - positions[a], positions[c + 1] - positions[a + 1], positions[c + 2] - positions[a + 2]];
    const p = cross(direction, v);
    const determinant = dot(u, p);
    if (Math.abs(determinant) < 1e-18) continue;
    const s = [from[0] - positions[a], from[1] - positions[a + 1], from[2] - positions[a + 2]];
    const x = dot(s, p) / determinant;
    if (x < 0 || x > 1) continue;
    const q = cross(s, u);
    const y = dot(direction, q) / determinant;
    if (y < 0 || x + y > 1) continue;
    const distance = dot(v, q) / determinant;
    if (distance > 0 && distance < nearest) nearest = distance;
  }
  return nearest < Infinity ? plus(from, direction, nearest) : null;
}
