//! Devices that are written in Python, for simulated time.

use std::sync::{Arc, Mutex, PoisonError};

use numpy::PyArray1;
use palpate::devices::{Capabilities, Device, DeviceFault, DeviceState, ForceCommand};
use palpate::model::{Turn, Vec3, turn_of};
use palpate::runtime::Nanos;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

/// The first exception of what is called in Python, until whoever waits for the run takes it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Failure(Arc<Mutex<Option<PyErr>>>);

impl Failure {
    /// Notes `error`, unless there is one already.
    pub(crate) fn note(&self, error: PyErr) {
        self.lock().get_or_insert(error);
    }

    pub(crate) fn is_there(&self) -> bool {
        self.lock().is_some()
    }

    /// The exception, as an error.
    ///
    /// # Errors
    /// If there is one.
    pub(crate) fn raise(&self) -> PyResult<()> {
        self.lock().take().map_or(Ok(()), Err)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Option<PyErr>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Why what is written in Python does not run on threads.
pub(crate) const NOT_REAL_TIME: &str = "is written in Python, whose interpreter may make a thread wait at any time for any other: a tick of 1 ms \
                                        cannot wait for it; use run(), in simulated time, or write it in Rust or C";

/// An object of Python's with `read(time)`, and `write(force)` if it takes forces.
#[derive(Debug)]
pub(crate) struct OwnDevice {
    object: Py<PyAny>,
    failure: Failure,
    name: String,
    capabilities: Capabilities,
    takes_force: bool,
    /// Time (s) and position of the read before: where no velocity is told, it is that of the way since.
    before: Option<(f64, Vec3)>,
}

impl OwnDevice {
    /// A device of what `object` can do; its exceptions go to `failure`.
    ///
    /// # Errors
    /// `TypeError` if it has no `read`, or a limit is no number.
    pub(crate) fn new(object: &Bound<'_, PyAny>, failure: Failure) -> PyResult<Self> {
        let name = object.get_type().name()?.to_string();
        if !object.hasattr("read")? {
            return Err(PyTypeError::new_err(format!("a device needs a method read(time), and {name} has none")));
        }
        let mut capabilities = Capabilities::default();
        if object.hasattr("max_force_n")? {
            capabilities.max_force_n = object.getattr("max_force_n")?.extract()?;
        }
        let takes_force = object.hasattr("write")?;
        Ok(Self { object: object.clone().unbind(), failure, name, capabilities, takes_force, before: None })
    }

    fn state(&mut self, py: Python<'_>, time: Nanos) -> PyResult<DeviceState> {
        let time_s = time.as_secs_f64();
        let told = self.object.bind(py).call_method1("read", (time_s,))?;
        let (position, velocity, turn) = parts(&told)?;
        let since = self.before.filter(|(before_s, _)| *before_s < time_s);
        let moved = || since.map_or(Vec3::zeros(), |(before_s, before)| (position - before) / (time_s - before_s));
        let velocity = velocity.unwrap_or_else(moved);
        self.before = Some((time_s, position));
        Ok(DeviceState { position, velocity, orientation: turn, ..DeviceState::default() })
    }
}

/// Position, or position and velocity, or those and a quaternion.
fn parts(told: &Bound<'_, PyAny>) -> PyResult<(Vec3, Option<Vec3>, Turn)> {
    let vector = |numbers: [f64; 3]| Vec3::from(numbers);
    if let Ok(position) = told.extract::<[f64; 3]>() {
        return Ok((vector(position), None, Turn::identity()));
    }
    if let Ok((position, velocity)) = told.extract::<([f64; 3], [f64; 3])>() {
        return Ok((vector(position), Some(vector(velocity)), Turn::identity()));
    }
    let told: ([f64; 3], [f64; 3], [f64; 4]) = told.extract().map_err(|_| {
        PyTypeError::new_err(
            "read(time) must give a position (x, y, z), or a tuple of position and velocity, or of position, velocity and a quaternion \
             (w, x, y, z)",
        )
    })?;
    Ok((vector(told.0), Some(vector(told.1)), turn_of(told.2)))
}

impl Device for OwnDevice {
    fn name(&self) -> &str {
        &self.name
    }

    fn capabilities(&self) -> Capabilities {
        self.capabilities
    }

    fn exerts_force(&self) -> bool {
        self.takes_force
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        if self.failure.is_there() {
            return Err(DeviceFault::Disconnected);
        }
        Python::attach(|py| self.state(py, time)).map_err(|error| {
            self.failure.note(error);
            DeviceFault::Disconnected
        })
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        if !command.is_finite() {
            return Err(DeviceFault::Refused);
        }
        if !self.takes_force || self.failure.is_there() {
            return Ok(());
        }
        let write = |py: Python<'_>| {
            let force = PyArray1::from_slice(py, command.force.as_slice());
            self.object.bind(py).call_method1("write", (force,)).map(drop)
        };
        Python::attach(write).map_err(|error| {
            self.failure.note(error);
            DeviceFault::Disconnected
        })
    }
}
