//! A run that is over: its arrays, whether they come from memory or from a log.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use numpy::PyReadonlyArray1;
use palpate::log::RunReport;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PySlice;

use crate::arrays::frozen;
use crate::errors::{OrRaise, usage};
use crate::recording::Recording;
use crate::table::Table;

/// A run that is over, or its log: what the tool felt and did, tick by tick.
///
/// Arrays are read-only views of memory that the run owns; nothing is copied. One row is one haptic tick, n of them. Of several devices the
/// arrays are those of the first; `run.device("right")` has those of another.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Run {
    shared: Arc<Shared>,
    /// What the topics of the device begin with: nothing, or `/NAME`.
    prefix: String,
    tool_rows: PyOnceLock<Py<PyAny>>,
    command_rows: PyOnceLock<Py<PyAny>>,
}

struct Shared {
    tables: BTreeMap<String, Py<Table>>,
    report: RunReport,
    damage: Option<String>,
    faults: Vec<String>,
}

impl Run {
    /// The run of which `recording` is left.
    ///
    /// # Errors
    /// If numpy is not there.
    pub(crate) fn new(py: Python<'_>, recording: Recording) -> PyResult<Self> {
        let Recording { topics, report, damage, faults, .. } = recording;
        let table = |(name, columns)| Ok((name, Py::new(py, Table::new(py, columns)?)?));
        let tables = topics.into_iter().map(table).collect::<PyResult<_>>()?;
        let first = report.environment.as_ref().map_or(String::new(), |environment| environment.device_prefix(0));
        Ok(Self::of(Arc::new(Shared { tables, report, damage, faults }), first))
    }

    fn of(shared: Arc<Shared>, prefix: String) -> Self {
        Self { shared, prefix, tool_rows: PyOnceLock::new(), command_rows: PyOnceLock::new() }
    }

    /// The table of this device's topic.
    fn own<'a, 'py>(&'a self, py: Python<'py>, word: &str) -> PyResult<&'a Bound<'py, Table>> {
        self.table(py, &format!("{}/{word}", self.prefix))
    }

    fn table<'a, 'py>(&'a self, py: Python<'py>, topic: &str) -> PyResult<&'a Bound<'py, Table>> {
        let found = self.shared.tables.get(topic).map(|table| table.bind(py));
        found.ok_or_else(|| {
            let known: Vec<&str> = self.shared.tables.keys().map(String::as_str).collect();
            PyKeyError::new_err(format!("there is no topic {topic:?}, the topics are {}", known.join(", ")))
        })
    }

    /// Columns of the topic `word` at the times of the forces, of which `rows` remembers the rows.
    fn at_forces<'py>(
        &self,
        py: Python<'py>,
        word: &str,
        rows: &PyOnceLock<Py<PyAny>>,
        first: &str,
        count: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let rows = rows.get_or_try_init(py, || self.rows_at_forces(py, word))?.bind(py);
        let columns = self.own(py, word)?.get().side_by_side(py, first, count)?.get_item(rows)?;
        columns.call_method1("setflags", (false,))?;
        Ok(columns)
    }

    /// The rows of the topic `word` at the times of the forces: a slice of its table, or, if some are missing, the number of each row's.
    fn rows_at_forces(&self, py: Python<'_>, word: &str) -> PyResult<Py<PyAny>> {
        let times = |word: &str| -> PyResult<PyReadonlyArray1<'_, f64>> {
            self.own(py, word)?.get().side_by_side(py, "t_s", 1)?.extract()
        };
        let (forces, others) = (times("force")?, times(word)?);
        let (forces, others) = (forces.as_array(), others.as_array());
        let from = forces.first().map_or(0, |first| others.iter().take_while(|time| *time < first).count());
        let equal = others.iter().skip(from).zip(&forces).filter(|(other, force)| other == force).count();
        if equal == forces.len() {
            let slice = PySlice::new(py, from as isize, (from + forces.len()) as isize, 1);
            return Ok(slice.into_any().unbind());
        }
        // The device gave nothing new for a while, or a record was lost: the newest there is.
        let mut newest = 0;
        let mut rows = Vec::with_capacity(forces.len());
        for force in &forces {
            while others.get(newest + 1).is_some_and(|time| time <= force) {
                newest += 1;
            }
            rows.push(newest as i64);
        }
        Ok(frozen(py, rows, 1)?.call_method0("ravel")?.unbind())
    }

    fn of_tool<'py>(&self, py: Python<'py>, first: &str, count: usize) -> PyResult<Bound<'py, PyAny>> {
        self.at_forces(py, "tool", &self.tool_rows, first, count)
    }
}

#[pymethods]
impl Run {
    /// End of each haptic tick (s), shape (n,).
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.own(py, "force")?.get().side_by_side(py, "t_s", 1)
    }

    /// Force on the tool (N), the mean over each tick, before the safety pipeline, shape (n, 3).
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.own(py, "force")?.get().side_by_side(py, "fx_n", 3)
    }

    /// Force that the device was commanded in each tick (N), after the safety pipeline, shape (n, 3). What it was commanded after the last
    /// one, while the force ramped to zero, is in `run["/force_commanded"]`.
    #[getter]
    fn commanded<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.at_forces(py, "force_commanded", &self.command_rows, "fx_n", 3)
    }

    /// Torque about the tool's centre (N m), the mean over each tick, before the safety pipeline, shape (n, 3); None if there was none.
    #[getter]
    fn torque<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let table = self.own(py, "force")?.get();
        table.has("tx_n_m").then(|| table.side_by_side(py, "tx_n_m", 3)).transpose()
    }

    /// Position of the tool at the end of each tick (m), shape (n, 3).
    #[getter]
    fn tool<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.of_tool(py, "x_m", 3)
    }

    /// Velocity of the tool at the end of each tick (m/s), shape (n, 3).
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.of_tool(py, "vx_m_s", 3)
    }

    /// Turn of the tool at the end of each tick as a quaternion (w, x, y, z), shape (n, 4); None if it was never turned.
    #[getter]
    fn orientation<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let is_turned = self.own(py, "tool")?.get().has("qw");
        is_turned.then(|| self.of_tool(py, "qw", 4)).transpose()
    }

    /// Contact at the end of each tick: its mode (free, stick, slip, lost), triangle, normal, forces (N), area (m^2).
    #[getter]
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, Table>> {
        self.own(py, "contact").cloned()
    }

    /// Each place at which a tool with a shape touched, a row for each.
    #[getter]
    fn contact_points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, Table>> {
        self.own(py, "contact/points").cloned()
    }

    /// Each replacement of a local model by a newer one: version, age (s), jump of the force before and after blending (N).
    #[getter]
    fn resyncs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, Table>> {
        self.own(py, "resync").cloned()
    }

    /// Each release of each rate group, by the group's name: scheduled, woke, start, end (ns), slips and their cause.
    #[getter]
    fn timing<'py>(&self, py: Python<'py>) -> BTreeMap<&str, Bound<'py, Table>> {
        let tables = self.shared.tables.iter();
        tables.filter_map(|(name, table)| Some((name.strip_prefix("/timing/")?, table.bind(py).clone()))).collect()
    }

    /// The names of the topics that there are, such as "/force".
    #[getter]
    fn topics(&self) -> Vec<&str> {
        self.shared.tables.keys().map(String::as_str).collect()
    }

    /// The table of a topic, such as run["/resync"], with the columns of `palpate export`.
    fn __getitem__<'py>(&self, py: Python<'py>, topic: &str) -> PyResult<Bound<'py, Table>> {
        self.table(py, topic).cloned()
    }

    /// The names of the devices; empty if there is one.
    #[getter]
    fn devices(&self) -> Vec<String> {
        self.shared.report.environment.as_ref().map_or(Vec::new(), |environment| environment.devices.clone())
    }

    /// The run as the device called `name` had it.
    fn device(&self, py: Python<'_>, name: &str) -> PyResult<Self> {
        let devices = self.devices();
        if devices.iter().any(|device| device == name) {
            return Ok(Self::of(Arc::clone(&self.shared), format!("/{name}")));
        }
        let known = if devices.is_empty() { "there is one without a name".to_owned() } else { devices.join(", ") };
        Err(usage(py, "name", &format!("is {name:?}, and the devices are: {known}")))
    }

    /// The local model that ran.
    #[getter]
    fn model(&self) -> Option<&str> {
        self.shared.report.environment.as_ref().map(|environment| environment.model.as_str())
    }

    /// What is known of the run as a whole: versions, model, rates (Hz), what the system granted.
    #[getter]
    fn environment<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, pyo3::types::PyDict>> {
        let known = pyo3::types::PyDict::new(py);
        let Some(environment) = &self.shared.report.environment else { return Ok(known) };
        known.set_item("palpate_version", &environment.palpate_version)?;
        known.set_item("instruction_set", &environment.instruction_set)?;
        known.set_item("is_virtual", self.shared.report.is_virtual())?;
        known.set_item("model", &environment.model)?;
        known.set_item("model_reason", environment.model_reason.as_ref().map(|reason| reason.why.as_str()))?;
        known.set_item("body", &environment.body)?;
        known.set_item("haptic_hz", environment.haptic_hz)?;
        known.set_item("global_hz", environment.global_hz)?;
        known.set_item("granted", environment.granted.clone())?;
        Ok(known)
    }

    /// The report that the command prints: lateness, slips, resyncs, forces, limits.
    #[getter]
    fn report(&self) -> String {
        self.shared.report.to_string()
    }

    /// What went wrong, a line each; empty if nothing did.
    #[getter]
    fn faults(&self) -> Vec<String> {
        self.shared.faults.clone()
    }

    /// What is damaged of the log that it was read from, and where; None if it is whole.
    #[getter]
    fn damage(&self) -> Option<&str> {
        self.shared.damage.as_deref()
    }

    /// A pandas.DataFrame of a topic, or, without one, of what each haptic tick did: force, tool, contact, a row for each.
    #[pyo3(signature = (topic = None))]
    fn to_pandas<'py>(slf: &Bound<'py, Self>, topic: Option<&str>) -> PyResult<Bound<'py, PyAny>> {
        match topic {
            Some(topic) => Table::to_pandas(slf.get().table(slf.py(), topic)?),
            None => slf.py().import("palpate._frames")?.call_method1("of_run", (slf,)),
        }
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.own(py, "force")?.get().rows())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let ticks = self.__len__(py)?;
        let model = self.model().unwrap_or("unknown");
        let seconds = self.shared.report.duration.as_secs_f64();
        let faults = match self.shared.faults.as_slice() {
            [] => String::new(),
            faults => format!(", {}", faults.join("; ")),
        };
        Ok(format!("<palpate.Run of {ticks} ticks, {seconds} s, model {model}{faults}>"))
    }
}

/// Reads a log of palpate's (MCAP): the run that it holds.
///
/// Of a damaged log it gives what is before the damage; `Run.damage` says what is wrong. Memory: as much as the log has unpacked.
///
/// Raises FileError if it cannot be read, LogError if it is no log.
#[pyfunction]
pub(crate) fn read(py: Python<'_>, path: PathBuf) -> PyResult<Run> {
    let recording = py.detach(|| Recording::read(&path)).or_raise(py)?;
    Run::new(py, recording)
}
