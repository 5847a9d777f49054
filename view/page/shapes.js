
// Unit shapes of which tools and arrows are put together: places and normals, three numbers each, in triangles.
function revolved(profile, around = 24) {
  // profile: pairs of radius and height, with normals of radius and height.
  const out = [];
  const vertex = ([r, z, nr, nz], angle) => out.push(r * Math.cos(angle), r * Math.sin(angle), z, nr * Math.cos(angle), nr * Math.sin(angle), nz);
  for (let n = 0; n < around; n += 1) {
    const [a, b] = [(2 * Math.PI * n) / around, (2 * Math.PI * (n + 1)) / around];
    for (let k = 0; k + 1 < profile.length; k += 2) {
      const [low, high] = [profile[k], profile[k + 1]];
      vertex(low, a); vertex(low, b); vertex(high, b);
      vertex(low, a); vertex(high, b); vertex(high, a);
    }
  }
  return new Float32Array(out);
}

function sphereProfile(steps = 14) {
  const at = (n) => { const a = -Math.PI / 2 + (Math.PI * n) / steps; return [Math.cos(a), Math.sin(a), Math.cos(a), Math.sin(a)]; };
  return Array.from({ length: steps }, (_, n) => [at(n), at(n + 1)]).flat();
}

const SHAPES = {
  sphere: revolved(sphereProfile()),
  cylinder: revolved([[1, 0, 1, 0], [1, 1, 1, 0], [0, 1, 0, 1], [1, 1, 0, 1]]),
  cone: revolved([[1, 0, 0.7, 0.7], [0, 1, 0.7, 0.7], [0, 0, 0, -1], [1, 0, 0, -1]]),
};
