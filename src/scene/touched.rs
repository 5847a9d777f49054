//! Where a scene's tool touches its body first.

use super::Scene;
use crate::model::Vec3;
use crate::model::body::Body;

impl Scene {
    /// The node of the surface of `body` that the first tool's path comes to first, within the body's extents; the middle of the
    /// top if it does not come there. `None` if nothing of the surface can move.
    pub fn first_touched(&self, body: &dyn Body) -> Option<u32> {
        let rest = body.rest();
        let extents = |by: fn(&Vec3, &Vec3) -> Vec3| rest.iter().copied().reduce(|a, b| by(&a, &b));
        let (low, high) = (extents(Vec3::inf)?, extents(Vec3::sup)?);
        let is_inside = |x: &&[f64; 3]| (0..3).all(|axis| (low[axis]..=high[axis]).contains(&x[axis]));
        let path = self.devices.first().and_then(|device| device.path.as_ref());
        let touched = path.and_then(|path| path.positions_m().iter().find(is_inside)).map(|&x| Vec3::from(x));
        let middle = 0.5 * (low + high);
        let point = touched.unwrap_or(Vec3::new(middle.x, middle.y, high.z));
        let is_movable = |node: &u32| body.surface().has_node(*node) && body.inverse_masses()[*node as usize] > 0.0;
        let distance = |node: &u32| (rest[*node as usize] - point).norm_squared();
        (0..rest.len() as u32).filter(is_movable).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}
