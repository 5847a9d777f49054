//! What tissue is made of.

use super::Where;

/// The parameters of a tissue.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tissue {
    /// Young's modulus E (Pa).
    pub young_modulus: f64,
    /// Poisson's ratio nu, below 0.5.
    pub poisson_ratio: f64,
    /// Density rho (kg/m^3).
    pub density: f64,
    /// Shear viscosity eta (Pa s).
    pub viscosity: f64,
}

/// A part of a body of tetrahedra that differs in material; an element belongs to it if its centroid at rest lies in it.
/// What it leaves out stays as it was.
#[derive(Clone, Debug, PartialEq)]
pub struct TissueRegion {
    /// The part.
    pub place: Where,
    /// Young's modulus E (Pa).
    pub young_modulus: Option<f64>,
    /// Poisson's ratio nu.
    pub poisson_ratio: Option<f64>,
    /// Density rho (kg/m^3).
    pub density: Option<f64>,
    /// Shear viscosity eta (Pa s).
    pub viscosity: Option<f64>,
}
