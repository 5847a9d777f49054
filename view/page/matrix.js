
// 4 x 4 matrices, column by column.
function times(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column += 1) {
    for (let row = 0; row < 4; row += 1) {
      let sum = 0;
      for (let k = 0; k < 4; k += 1) sum += a[4 * k + row] * b[4 * column + k];
      out[4 * column + row] = sum;
    }
  }
  return out;
}

function perspective(tangent, aspect, near, far) {
  const f = 1 / tangent;
  return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0]);
}

// The unit z axis to from -> to, with these widths.
function along(from, to, width) {
  const way = minus(to, from);
  const z = unit(way);
  const x = unit(cross(Math.abs(z[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], z));
  const y = cross(z, x);
  return new Float32Array([...x.map((c) => c * width), 0, ...y.map((c) => c * width), 0, ...way, 0, ...from, 1]);
}

const ball = (centre, radius) => new Float32Array([radius, 0, 0, 0, 0, radius, 0, 0, 0, 0, radius, 0, ...centre, 1]);
