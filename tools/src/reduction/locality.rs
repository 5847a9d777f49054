//! How much of what a tool feels at a contact a patch between held surroundings captures.

use nalgebra::Complex;
use palpate::model::ModelError;

use super::congruence::Congruence;
use super::krylov::many_shifts;
use super::linalg::{CMatrix, DEPENDENT, Matrix, SparseFactor, append_orthonormal, complex, product_t, side_by_side};
use super::linear_body::LinearBody;
use super::modal::Modal;
use super::response::{Response, log_spaced};
use super::system::{Ports, Rayleigh};

/// Frequencies (Hz) at which the response of a contact is matched, rest among them: each costs a factorisation, and three solutions a
/// contact. They are dense where the slow modes of a body of tissue ring.
const MATCHED_HZ: [f64; 12] = [0.0, 5.0, 10.0, 14.0, 20.0, 28.0, 40.0, 60.0, 100.0, 200.0, 500.0, 1000.0];
/// Frequencies in the band that errors are taken over.
const SAMPLES: usize = 25;
/// Patches of more coordinates, and those without modes, are reduced first.
const DENSE: usize = 400;
/// Contacts that are solved for together.
const TOGETHER: usize = 16;

/// The dynamic stiffness at a contact, from a tool's displacement to the force on it: Z(s) = (G D(s)^-1 G^T)^-1, 3 x 3, with
/// D = s^2 M + s C + K.
#[derive(Clone, Debug)]
pub struct ContactStiffness {
    compliance: Small,
}

/// A compliance in few states.
#[derive(Clone, Debug)]
enum Small {
    Modal(Modal),
    General(Congruence),
}

impl ContactStiffness {
    /// The stiffness of a compliance: forces at the contact go in, its displacements come out.
    pub fn of(model: Congruence) -> Self {
        let compliance = match Modal::of(&model) {
            Some(modal) => Small::Modal(modal),
            None => Small::General(model),
        };
        Self { compliance }
    }
}

impl Response for ContactStiffness {
    fn at(&self, s: Complex<f64>) -> Option<CMatrix> {
        match &self.compliance {
            Small::Modal(modal) => modal.at(s),
            Small::General(model) => model.at(s),
        }?
        .try_inverse()
    }
}

/// Errors of one dynamic stiffness against another: norms of the difference over the norm of the reference.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StiffnessError {
    /// The error at rest.
    pub at_rest: f64,
    /// The root of the mean square error over the logarithm of the frequency in the band.
    pub band: f64,
    /// The worst error in the band.
    pub worst: f64,
}

impl StiffnessError {
    /// The errors of `model` against `reference` over `hz`, the first of them for rest.
    pub fn between(model: &dyn Response, reference: &dyn Response, hz: &[f64]) -> Self {
        let errors: Vec<f64> = hz
            .iter()
            .map(|&hz| match (model.at_hz(hz), reference.at_hz(hz)) {
                (Some(a), Some(b)) => (a - &b).norm() / b.norm(),
                _ => f64::INFINITY,
            })
            .collect();
        let Some((&at_rest, band)) = errors.split_first() else { return Self::default() };
        let mean = band.iter().map(|error| error * error).sum::<f64>() / band.len().max(1) as f64;
        Self { at_rest, band: mean.sqrt(), worst: band.iter().fold(0.0, |worst: f64, &error| worst.max(error)) }
    }
}

/// Finds the stiffness of a body at any contact, and that of patches.
///
/// The whole body's is matched at twelve real frequencies (rational Krylov, Grimme 1997): it is factorised once for each, whatever the number of
/// contacts.
#[derive(Debug)]
pub struct LocalityCheck<'a> {
    body: &'a LinearBody,
    rayleigh: Option<Rayleigh>,
    matched: Vec<(f64, SparseFactor)>,
    /// Rest, and the band (Hz).
    hz: Vec<f64>,
}

impl<'a> LocalityCheck<'a> {
    /// A check for contacts with `body` and errors over `band_hz`.
    ///
    /// # Errors
    /// If nothing holds the body.
    pub fn new(body: &'a LinearBody, band_hz: [f64; 2]) -> Result<Self, ModelError> {
        let factor = |&hz: &f64| {
            let s = 2.0 * std::f64::consts::PI * hz;
            Ok((s, body.system().factorised(s)?))
        };
        let matched = MATCHED_HZ.iter().map(factor).collect::<Result<_, ModelError>>()?;
        let hz = [vec![0.0], log_spaced(band_hz[0], band_hz[1], SAMPLES)].concat();
        Ok(Self { body, rayleigh: body.system().rayleigh(), matched, hz })
    }

    /// The frequencies at which errors are taken: rest, and those of the band (Hz).
    pub fn frequencies(&self) -> &[f64] {
        &self.hz
    }

    /// The whole body's stiffness at each of `contacts`, given by G^T (n x 3).
    pub fn whole(&self, contacts: &[Matrix]) -> Vec<ContactStiffness> {
        contacts.chunks(TOGETHER).flat_map(|together| self.whole_together(together)).collect()
    }

    fn whole_together(&self, contacts: &[Matrix]) -> Vec<ContactStiffness> {
        let all = side_by_side(&contacts.iter().collect::<Vec<_>>());
        let answers: Vec<Matrix> = self.matched.iter().map(|(_, factor)| factor.solve(all.clone())).collect();
        let of = |at: usize| {
            let at_contact = answers.iter().map(|answer| answer.columns(3 * at, 3).into_owned()).collect::<Vec<_>>();
            self.project(&at_contact, &contacts[at])
        };
        (0..contacts.len()).map(of).collect()
    }

    /// In the span of the answers at a contact.
    fn project(&self, answers: &[Matrix], contact: &Matrix) -> ContactStiffness {
        // Answers at near frequencies are alike: what is kept is in what they differ.
        let mut basis = Matrix::zeros(contact.nrows(), 0);
        answers.iter().for_each(|block| {
            append_orthonormal(&mut basis, block, DEPENDENT);
        });
        let ports = Ports::compliance(product_t(&basis, contact));
        ContactStiffness::of(Congruence::with(self.body.system(), &basis, ports, self.rayleigh))
    }

    /// The stiffness at a contact, matched at twice as many frequencies as [`whole`](Self::whole): how far the two are apart says how good
    /// that is.
    ///
    /// # Errors
    /// None that [`new`](Self::new) does not have.
    pub fn finer(&self, contact: &Matrix) -> Result<ContactStiffness, ModelError> {
        let system = self.body.system();
        let between =
            MATCHED_HZ.windows(2).map(|pair| if pair[0] == 0.0 { 0.5 * pair[1] } else { (pair[0] * pair[1]).sqrt() });
        let mut answers: Vec<Matrix> = self.matched.iter().map(|(_, factor)| factor.solve(contact.clone())).collect();
        for hz in between {
            answers.push(system.solve(2.0 * std::f64::consts::PI * hz, contact.clone())?);
        }
        Ok(self.project(&answers, contact))
    }

    /// The stiffness of the patch with these coordinates (in increasing order), all others held, at a contact.
    ///
    /// # Errors
    /// If the patch is not held together.
    pub fn patch(&self, coordinates: &[usize], contact: &Matrix) -> Result<ContactStiffness, ModelError> {
        let ports = Ports::compliance(contact.select_rows(coordinates));
        let part = self.body.system().part(coordinates).with_ports(ports)?;
        if coordinates.len() <= DENSE && self.rayleigh.is_some() {
            return Ok(ContactStiffness::of(Congruence::whole(&part)));
        }
        let shifts: Vec<f64> = self.matched.iter().map(|(s, _)| *s).collect();
        Ok(ContactStiffness::of(many_shifts(&part, &shifts)?.model))
    }
}

/// The stiffness at rest along a direction (N/m).
pub fn stiffness_along(model: &dyn Response, direction: [f64; 3]) -> f64 {
    let Some(z) = model.at_hz(0.0) else { return f64::NAN };
    let direction = complex(&Matrix::from_column_slice(3, 1, &direction));
    (direction.transpose() * z * direction)[(0, 0)].re
}
