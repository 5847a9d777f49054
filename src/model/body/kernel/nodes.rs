//! Nodes in memory as the kernels want them: coordinate by coordinate for a lattice, one cache line each for a network.

/// Springs, or nodes, that a kernel takes at once.
pub(crate) const LANES: usize = 8;

/// Eight doubles in memory.
pub(crate) type Lane = [f64; LANES];

/// Sixteen singles in memory: as much.
pub(crate) type Singles = [f32; 2 * LANES];

/// Position and velocity of one node: x, y, z, unused, and again. One cache line, one AVX-512 register.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(crate) struct Motion(pub(super) Lane);

/// The force on one node: x, y, z, unused.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(32))]
pub(crate) struct Push(pub(super) [f64; 4]);

/// Doubles in a cache line and in a page.
const LINE: usize = 8;
const PAGE: usize = 512;

/// Nine coordinate arrays of the same length in one piece of memory: positions, velocities, forces.
#[derive(Debug)]
pub(super) struct Arrays {
    memory: Vec<f64>,
    stride: usize,
}

impl Clone for Arrays {
    /// The same room with zeros in it: at another address the arrays begin elsewhere, and what was a NaN in a node would
    /// stand beyond the last one, where nobody overwrites it.
    fn clone(&self) -> Self {
        Self { memory: vec![0.0; self.memory.len()], stride: self.stride }
    }
}

impl Arrays {
    /// Room for `nodes` nodes and all the lanes of the last ones.
    pub(super) fn new(nodes: usize) -> Self {
        // Starts 7 cache lines apart modulo a page: were they equal, a load would wait for the store of another array.
        let length = nodes.next_multiple_of(LANES);
        let stride = length + (7 * LINE + PAGE - length % PAGE) % PAGE;
        Self { memory: vec![0.0; 9 * stride + LINE], stride }
    }

    /// Positions and velocities, and forces; all begin at a cache line and are equally long.
    pub(super) fn split(&mut self) -> ([&mut [f64]; 6], [&mut [f64]; 3]) {
        let first = self.memory.as_ptr().align_offset(LINE * size_of::<f64>()).min(LINE);
        let mut rest = &mut self.memory[first..];
        let stride = self.stride;
        let mut next = move || {
            let (array, others) = std::mem::take(&mut rest).split_at_mut(stride);
            rest = others;
            array
        };
        ([next(), next(), next(), next(), next(), next()], [next(), next(), next()])
    }
}
