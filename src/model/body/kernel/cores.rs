//! The parts of one evaluation, each on a core of its own.

#[cfg(feature = "parallel")]
use crate::error::ModelError;

/// Looks at whether the helpers are done before the calling thread sleeps: some 100 us.
#[cfg(feature = "parallel")]
const SPINS: u32 = 4096;

/// The threads that help; without any, one part follows the other.
#[derive(Clone, Debug, Default)]
pub(super) struct Cores {
    #[cfg(feature = "parallel")]
    helpers: Option<std::sync::Arc<rayon::ThreadPool>>,
}

impl Cores {
    /// The calling thread and `cores` - 1 helpers.
    #[cfg(feature = "parallel")]
    pub(super) fn new(cores: usize) -> Result<Self, ModelError> {
        let helpers = match cores {
            0 => return Err(ModelError::of("cores", "0: at least 1 is needed")),
            1 => None,
            _ => {
                let threads = rayon::ThreadPoolBuilder::new().num_threads(cores - 1);
                let name = |n| format!("palpate-springs-{n}");
                let pool = threads.thread_name(name).build();
                Some(std::sync::Arc::new(pool.map_err(|e| ModelError::of("cores", format!("{cores}: {e}")))?))
            }
        };
        Ok(Self { helpers })
    }

    /// Calls `work` for each of `parts`, the first on the calling thread; returns when all are done.
    pub(super) fn each<P: Send>(&self, parts: impl IntoIterator<Item = P>, work: impl Fn(P) + Sync) {
        #[allow(unused_mut, reason = "only the parallel feature takes the first one out")]
        let mut parts = parts.into_iter();
        #[cfg(feature = "parallel")]
        if let Some(helpers) = &self.helpers {
            let first = parts.next();
            let work = &work;
            helpers.in_place_scope(|scope| {
                let busy = std::sync::Arc::new(());
                for part in parts {
                    let busy = busy.clone();
                    scope.spawn(move |_| {
                        work(part);
                        drop(busy);
                    });
                }
                first.into_iter().for_each(work);
                // Parts take about as long, so the others end soon. To sleep until then would cost the wake-up.
                let mut left = SPINS;
                while left > 0 && std::sync::Arc::strong_count(&busy) > 1 {
                    std::hint::spin_loop();
                    left -= 1;
                }
            });
            return;
        }
        parts.for_each(work);
    }
}
