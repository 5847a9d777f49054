//! A session that runs in real time, on threads of Rust, and its page.

use std::net::IpAddr;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use palpate::devices::PointerHandle;
use palpate::session::{Running, Summary, Viewer};
use palpate_view::{NotServed, Options, Server};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;

use crate::arrays::frozen_points;
use crate::errors::{OrRaise, usage};
use crate::recording::Recording;
use crate::run::Run;

/// How long a wait goes on before it looks whether somebody pressed Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);
/// How long it goes on before it looks whether the session has ended.
const NAP: Duration = Duration::from_millis(5);

/// A session that runs in real time on threads of its own, which Python never makes wait.
///
/// `Session.start()` makes one. As a context manager it stops the session at the end of the block: the force ramps to zero and the threads
/// end. `stop()` does so too and gives the Run.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Live {
    stage: Mutex<Stage>,
    log: Option<PathBuf>,
    name: String,
    run: PyOnceLock<Py<Run>>,
}

/// Where the session is. Locked for a moment at a time, and never while Python is held.
enum Stage {
    Runs {
        running: Box<Running>,
        viewer: Option<Box<Viewer>>,
        pointer: Option<PointerHandle>,
    },
    Shown(Server),
    /// Somebody is ending it.
    Ends,
    Over,
}

impl Live {
    pub(crate) fn new(running: Running, log: Option<PathBuf>, name: String) -> Self {
        let stage = Mutex::new(Stage::Runs { running: Box::new(running), viewer: None, pointer: None });
        Self { stage, log, name, run: PyOnceLock::new() }
    }

    fn lock(&self) -> MutexGuard<'_, Stage> {
        self.stage.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until `is_over` says so, or `seconds` have passed. An interrupt ends it.
    fn until(&self, py: Python<'_>, seconds: Option<f64>, is_over: impl Fn(&Stage) -> bool + Sync) -> PyResult<()> {
        let end = seconds
            .map(|seconds| Instant::now() + Duration::try_from_secs_f64(seconds.max(0.0)).unwrap_or(Duration::MAX / 4));
        loop {
            let look = Instant::now() + LOOK;
            let look = end.map_or(look, |end| end.min(look));
            let is_over = py.detach(|| {
                loop {
                    // Other threads have the session while this one sleeps.
                    if is_over(&self.lock()) {
                        return true;
                    }
                    let left = look.saturating_duration_since(Instant::now());
                    if left.is_zero() {
                        return false;
                    }
                    std::thread::sleep(left.min(NAP));
                }
            });
            if is_over || end.is_some_and(|end| Instant::now() >= end) {
                return Ok(());
            }
            py.check_signals()?;
        }
    }

    /// Ends the session, and says how it went.
    fn end(&self) -> Option<Summary> {
        // Threads are joined without the lock: others may look meanwhile.
        let stage = std::mem::replace(&mut *self.lock(), Stage::Ends);
        let summary = match stage {
            Stage::Runs { running, .. } => Some(running.stop()),
            Stage::Shown(server) => server.stop(),
            Stage::Over => None,
            Stage::Ends => return None,
        };
        *self.lock() = Stage::Over;
        summary
    }

    /// What is left of the session, for whoever ends it.
    fn recording(&self) -> Result<Option<Recording>, palpate::Error> {
        let Some(summary) = self.end() else { return Ok(None) };
        let Some(log) = &self.log else { return Ok(Some(Recording::of_run(summary))) };
        let faults = Recording::faults_of(&summary);
        let mut recording = Recording::read(log)?;
        recording.faults = faults;
        Ok(Some(recording))
    }
}

#[pymethods]
impl Live {
    /// Waits until the session has ended by itself, or `seconds` have passed. Ctrl-C ends the wait with KeyboardInterrupt.
    #[pyo3(signature = (seconds = None))]
    fn wait(&self, py: Python<'_>, seconds: Option<f64>) -> PyResult<()> {
        self.until(py, seconds, |stage| match stage {
            Stage::Runs { running, .. } => running.finished(),
            Stage::Shown(server) => server.wait_for(Duration::ZERO),
            Stage::Ends => false,
            Stage::Over => true,
        })
    }

    /// Shows the session as a page in the browser: the body, the tool, the force, strips of what every tick did. A tool whose device is a
    /// pointer (`settings={"device": {"kind": "pointer"}}`) is pushed with the mouse. From then on the page has the session; `stop()` ends
    /// both.
    ///
    /// seconds: how long to stay; without, until Ctrl-C (in a notebook: until it is interrupted); 0 returns at once, and the page stays
    /// until `stop()`. port: 0 for a free one. listen: an address of this machine, to let others in, unencrypted. open: opens a browser.
    ///
    /// Gives the address, with the token that lets a browser in.
    #[pyo3(signature = (*, seconds = None, port = 0, listen = None, open = true))]
    fn view(
        &self,
        py: Python<'_>,
        seconds: Option<f64>,
        port: u16,
        listen: Option<&str>,
        open: bool,
    ) -> PyResult<String> {
        let mut options = Options { port, title: self.name.clone(), ..Options::default() };
        if let Some(address) = listen {
            let parsed: Option<IpAddr> = address.parse().ok();
            options.listen =
                parsed.ok_or_else(|| usage(py, "listen", "must be an address such as 127.0.0.1 or 0.0.0.0"))?;
        }
        let shown = py.detach(|| {
            let mut stage = self.lock();
            match std::mem::replace(&mut *stage, Stage::Over) {
                Stage::Runs { running, viewer: None, pointer: None } => {
                    let (shown, url) = match palpate_view::serve(*running, &options) {
                        Ok(server) => {
                            let url = server.url();
                            (Stage::Shown(server), Ok(Some(url)))
                        }
                        // It goes on without a page.
                        Err(NotServed { running, error }) => {
                            (Stage::Runs { running, viewer: None, pointer: None }, Err(error))
                        }
                    };
                    *stage = shown;
                    url
                }
                Stage::Shown(server) => {
                    let url = server.url();
                    *stage = Stage::Shown(server);
                    Ok(Some(url))
                }
                other => {
                    *stage = other;
                    Ok(None)
                }
            }
        });
        let refused = "the session is over, or now() or point() has what the page needs: call view() before them";
        let url = shown.or_raise(py)?.ok_or_else(|| usage(py, "view", refused))?;
        py.import("builtins")?.call_method1("print", (format!("{}: {url}", self.name),))?;
        if open {
            py.import("webbrowser")?.call_method1("open", (&url,))?;
        }
        let waited = self.until(py, seconds, |stage| match stage {
            Stage::Shown(server) => server.wait_for(Duration::ZERO),
            _ => true,
        });
        // Ctrl-C is how a page is left.
        match waited {
            Err(error) if error.is_instance_of::<PyKeyboardInterrupt>(py) && seconds.is_none() => Ok(url),
            other => other.map(|()| url),
        }
    }

    /// The newest surface, tool and force, as a dictionary: time_s, position (3,) (m), force (3,), that the model computed (N), commanded
    /// (3,), what the hand feels (N), and nodes (n, 3) (m), at the rate of the global model. It disturbs no tick. Not beside a page.
    fn now<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let seen = py.detach(|| {
            let mut stage = self.lock();
            let Stage::Runs { running, viewer, .. } = &mut *stage else { return None };
            if viewer.is_none() {
                *viewer = running.take_viewer().map(Box::new);
            }
            let viewer = viewer.as_mut()?;
            Some((viewer.tool(), viewer.surface().positions.clone()))
        });
        let (tool, nodes) = seen.ok_or_else(|| usage(py, "now", "the session is over, or a page shows it"))?;
        let now = PyDict::new(py);
        now.set_item("time_s", tool.time.as_secs_f64())?;
        for (name, vector) in
            [("position", tool.position), ("force", tool.computed_force), ("commanded", tool.commanded_force)]
        {
            now.set_item(name, frozen_points(py, &[vector])?.get_item(0)?)?;
        }
        now.set_item("nodes", frozen_points(py, &nodes)?)?;
        Ok(now)
    }

    /// Wants the tool at `place` (x, y, z) (m), of a session whose device is a pointer: a spring draws it there. Not beside a page.
    fn point(&self, py: Python<'_>, place: [f64; 3]) -> PyResult<()> {
        let pointed = py.detach(|| {
            let mut stage = self.lock();
            let Stage::Runs { running, pointer, .. } = &mut *stage else { return None };
            if pointer.is_none() {
                *pointer = running.take_pointer(0);
            }
            Some(pointer.as_mut()?.point(place))
        });
        match pointed {
            Some(true) => Ok(()),
            Some(false) => Err(usage(py, "place", "must be three finite numbers, in metres")),
            None => Err(usage(
                py,
                "point",
                "needs a session that runs, without a page, with settings={\"device\": {\"kind\": \"pointer\"}}",
            )),
        }
    }

    /// Time since the start (s); None once it is over or a page has it.
    #[getter]
    fn elapsed(&self, py: Python<'_>) -> Option<f64> {
        py.detach(|| match &*self.lock() {
            Stage::Runs { running, .. } => Some(running.elapsed().as_secs_f64()),
            _ => None,
        })
    }

    /// Whether the session has ended, by itself or by stop().
    #[getter]
    fn finished(&self, py: Python<'_>) -> bool {
        py.detach(|| match &*self.lock() {
            Stage::Runs { running, .. } => running.finished(),
            Stage::Shown(_) | Stage::Ends => false,
            Stage::Over => true,
        })
    }

    /// Ends the session, if it has not ended, and gives its Run. What went wrong is in `Run.faults`.
    fn stop(&self, py: Python<'_>) -> PyResult<Py<Run>> {
        let run = self.run.get_or_try_init(py, || {
            let left = py.detach(|| self.recording()).or_raise(py)?;
            let nothing = "nothing is left of the session: its log could not be read, or another thread is ending it";
            Py::new(py, Run::new(py, left.ok_or_else(|| usage(py, "stop", nothing))?)?)
        });
        run.map(|run| run.clone_ref(py))
    }

    fn __enter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    #[pyo3(signature = (*_arguments))]
    fn __exit__(&self, py: Python<'_>, _arguments: &Bound<'_, pyo3::types::PyTuple>) -> PyResult<()> {
        self.stop(py).map(drop)
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let state = py.detach(|| match &*self.lock() {
            Stage::Runs { running, .. } => format!("{:.1} s", running.elapsed().as_secs_f64()),
            Stage::Shown(_) => "on a page".to_owned(),
            Stage::Ends | Stage::Over => "over".to_owned(),
        });
        format!("<palpate.Live of {}, {state}>", self.name)
    }
}
