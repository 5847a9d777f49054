//! The portable instruction set: plain arithmetic on arrays, which the compiler vectorises as far as it can.

use super::nodes::{LANES, Lane, Motion, Push, Singles};
use super::simd::{Numbers, Simd};

/// Plain arithmetic: no fused multiply-add, which a processor may lack, but where it is asked for by name; exact root and
/// division.
#[derive(Clone, Copy, Debug)]
pub(super) struct Portable;

/// Operations on one double after the other.
macro_rules! lanewise {
    ($($name:ident($($x:ident),+) = $of_one:expr;)+) => {$(
        #[inline(always)]
        fn $name(self, $($x: Lane),+) -> Lane {
            std::array::from_fn(|lane| {
                $(let $x = $x[lane];)+
                $of_one
            })
        }
    )+};
}

impl Simd for Portable {
    type V = Lane;
    type M = [bool; LANES];
    type W = Singles;

    #[inline(always)]
    fn splat(self, value: f64) -> Lane {
        [value; LANES]
    }

    #[inline(always)]
    fn load(self, from: &Lane) -> Lane {
        *from
    }

    #[inline(always)]
    fn store(self, value: Lane, to: &mut Lane) {
        *to = value;
    }

    lanewise! {
        add(a, b) = a + b;
        sub(a, b) = a - b;
        mul(a, b) = a * b;
        larger(a, b) = if a > b { a } else { b };
        mul_add(a, b, c) = a * b + c;
        mul_sub_from(a, b, c) = c - a * b;
        fused(a, b, c) = a.mul_add(b, c);
        fused_from(a, b, c) = (-a).mul_add(b, c);
        inverse_root(x) = 1.0 / x.sqrt();
    }

    #[inline(always)]
    fn keep(self, bits: [bool; LANES], x: Lane, limit: Lane, value: Lane) -> Lane {
        // A NaN is kept: it must come out as one and not as a force of zero.
        std::array::from_fn(|lane| if !bits[lane] | (x[lane] < limit[lane]) { 0.0 } else { value[lane] })
    }

    #[inline(always)]
    fn mask(self, bits: u8) -> [bool; LANES] {
        std::array::from_fn(|lane| bits >> lane & 1 == 1)
    }

    #[inline(always)]
    fn splat_single(self, value: f32) -> Singles {
        [value; 2 * LANES]
    }

    #[inline(always)]
    fn load_singles(self, from: &Singles) -> Singles {
        *from
    }

    #[inline(always)]
    fn store_singles(self, value: Singles, to: &mut Singles) {
        *to = value;
    }

    #[inline(always)]
    fn mul_add_single(self, a: Singles, b: Singles, c: Singles) -> Singles {
        std::array::from_fn(|lane| a[lane] * b[lane] + c[lane])
    }

    #[inline(always)]
    fn load_halves(self, from: &[u32; 2 * LANES]) -> [Singles; 2] {
        [from.map(|word| f32::from_bits(word << 16)), from.map(f32::from_bits)]
    }

    #[inline(always)]
    fn shift_down(self, a: Lane, b: Lane) -> Lane {
        [a[1], a[2], a[3], a[4], a[5], a[6], a[7], b[0]]
    }

    #[inline(always)]
    fn shift_up(self, a: Lane, b: Lane) -> Lane {
        [a[7], b[0], b[1], b[2], b[3], b[4], b[5], b[6]]
    }

    #[inline(always)]
    fn differences(self, nodes: &[Motion], from: &Numbers, to: &Numbers) -> [[Lane; 4]; 2] {
        let mut differences = [[[0.0; LANES]; 4]; 2];
        for lane in 0..LANES {
            let (here, there) = (&nodes[from[lane] as usize].0, &nodes[to[lane] as usize].0);
            for axis in 0..4 {
                differences[0][axis][lane] = there[axis] - here[axis];
                differences[1][axis][lane] = there[4 + axis] - here[4 + axis];
            }
        }
        differences
    }

    #[inline(always)]
    fn fourth(self, nodes: &[Motion], at: &Numbers) -> Lane {
        at.map(|node| nodes[node as usize].0[3])
    }

    #[inline(always)]
    fn exchange(self, pull: [Lane; 3], forces: &mut [Push], from: &Numbers, to: &Numbers) {
        for lane in 0..LANES {
            for (axis, pull) in pull.iter().enumerate() {
                forces[from[lane] as usize].0[axis] += pull[lane];
                forces[to[lane] as usize].0[axis] -= pull[lane];
            }
        }
    }

    #[inline(always)]
    fn push(self, force: [Lane; 3], forces: &mut [Push], to: &Numbers) {
        for lane in 0..LANES {
            for (axis, force) in force.iter().enumerate() {
                forces[to[lane] as usize].0[axis] += force[lane];
            }
        }
    }
}
