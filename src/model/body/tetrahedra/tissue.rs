//! What tissue is made of.

use super::Where;
use crate::error::ModelError;

/// The parameters of a tissue.
///
/// The presets are orders of magnitude, the middle of the ranges in the literature for small strains: tissue differs between
/// people, with age, illness, blood pressure and direction, and by how it was measured.
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

impl Tissue {
    /// Liver, healthy: E 2 to 8 kPa (elastography of people), order of magnitude.
    pub const LIVER: Self = Self::of(5e3, 1060.0, 2.0);
    /// Fat: E 1 to 3 kPa (elastography and indentation), order of magnitude.
    pub const FAT: Self = Self::of(2e3, 920.0, 1.0);
    /// Skeletal muscle at rest: E 10 to 40 kPa (elastography), order of magnitude; it is softer across its fibres.
    pub const MUSCLE: Self = Self::of(20e3, 1060.0, 3.0);
    /// Prostate, healthy: E 10 to 30 kPa (elastography and compression of samples), order of magnitude.
    pub const PROSTATE: Self = Self::of(20e3, 1050.0, 3.0);
    /// Solid tumours: E 20 to 100 kPa (elastography and compression of samples), order of magnitude.
    pub const TUMOUR: Self = Self::of(50e3, 1060.0, 5.0);
    /// Skin: E 50 to 200 kPa (suction and indentation on people), order of magnitude.
    pub const SKIN: Self = Self::of(100e3, 1100.0, 5.0);

    /// Nearly incompressible, as all that is mostly water: nu 0.45 to 0.499 in the literature.
    const fn of(young_modulus: f64, density: f64, viscosity: f64) -> Self {
        Self { young_modulus, poisson_ratio: 0.45, density, viscosity }
    }

    /// mu = E / (2 (1 + nu)) (Pa).
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn shear_modulus(&self) -> f64 {
        self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))
    }

    /// Lame's first parameter, E nu / ((1 + nu) (1 - 2 nu)) (Pa).
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn lame(&self) -> f64 {
        let nu = self.poisson_ratio;
        self.young_modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    }

    /// Speed of pressure waves, sqrt((lambda + 2 mu) / rho) (m/s).
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn wave_speed(&self) -> f64 {
        ((self.lame() + 2.0 * self.shear_modulus()) / self.density).sqrt()
    }

    /// Refuses what is no tissue.
    pub(super) fn check(&self) -> Result<(), ModelError> {
        let refuse = |key: &str, value: f64, needed: &str| Err(ModelError::of(key, format!("{value}: {needed}")));
        let positive = |value: f64| value.is_finite() && value > 0.0;
        if !positive(self.young_modulus) {
            return refuse("young_modulus_pa", self.young_modulus, "a finite value above 0 is needed");
        }
        if !(self.poisson_ratio >= 0.0 && self.poisson_ratio < 0.5) {
            let needed = "at least 0 and less than 0.5 is needed, 0.45 to 0.499 for tissue";
            return refuse("poisson_ratio", self.poisson_ratio, needed);
        }
        if !positive(self.density) {
            return refuse("density_kg_m3", self.density, "a finite value above 0 is needed");
        }
        if !(self.viscosity.is_finite() && self.viscosity >= 0.0) {
            return refuse("viscosity_pa_s", self.viscosity, "a finite value of at least 0 is needed");
        }
        let per_mass = [self.wave_speed(), self.viscosity / self.density, self.lame()];
        if !per_mass.iter().all(|value| value.is_finite()) {
            let message =
                "stiffness or viscosity over density is beyond all numbers, check the units (Pa, Pa s, kg/m^3)";
            return Err(ModelError::new(message));
        }
        Ok(())
    }
}

/// A part of a body of tetrahedra that differs in material; an element belongs to it if its centroid at rest lies in it.
/// What it leaves out stays as it was.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
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

impl TissueRegion {
    /// A region that is all of `tissue`.
    pub fn of(place: Where, tissue: Tissue) -> Self {
        let Tissue { young_modulus, poisson_ratio, density, viscosity } = tissue;
        Self {
            place,
            young_modulus: Some(young_modulus),
            poisson_ratio: Some(poisson_ratio),
            density: Some(density),
            viscosity: Some(viscosity),
        }
    }

    /// What `tissue` becomes in it.
    pub(super) fn over(&self, tissue: &Tissue) -> Tissue {
        Tissue {
            young_modulus: self.young_modulus.unwrap_or(tissue.young_modulus),
            poisson_ratio: self.poisson_ratio.unwrap_or(tissue.poisson_ratio),
            density: self.density.unwrap_or(tissue.density),
            viscosity: self.viscosity.unwrap_or(tissue.viscosity),
        }
    }

    /// True if it changes nothing.
    pub(super) fn is_idle(&self) -> bool {
        [self.young_modulus, self.poisson_ratio, self.density, self.viscosity] == [None; 4]
    }
}
