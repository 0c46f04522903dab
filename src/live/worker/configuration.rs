//! What a reload may change of a running worker.

use std::sync::{Arc, Mutex, PoisonError};

use didim_core::identification::Estimate;

use super::options::WindowPlan;
use super::setup::ResultOptions;
use crate::archive::drift::Baseline;
use crate::archive::store::FoundLoad;
use crate::window::Window;

/// Why a window could not be identified; its text reaches the status.
pub type Refusal = Box<dyn core::error::Error + Send + Sync>;

/// The outcome of a window.
#[derive(Clone, Debug)]
pub struct Identified {
    /// The result.
    pub estimate: Estimate,
    /// A report to store beside it (HTML).
    pub report: Option<String>,
}

/// Identifies from one window.
pub type Identify = Box<dyn FnMut(&Window) -> Result<Identified, Refusal> + Send>;

/// Finds what the arm carried along a window beyond what it did with a baseline.
pub type FindLoad = Arc<dyn Fn(&Baseline, &Window) -> Result<FoundLoad, Refusal> + Send + Sync>;

/// How windows are cut and identified, valid from one window to another.
pub struct Configuration {
    /// The windows; their sample rate is the stream's.
    pub windows: WindowPlan,
    /// What identifies one.
    pub identify: Identify,
    /// What finds the load along one; nothing looks for none.
    pub find_load: Option<FindLoad>,
    /// Hash of the configuration, for the results.
    pub sha256: String,
    /// What is stored beside the results.
    pub results: ResultOptions,
}

/// What identifies a window and names the configuration that it did so with. A window has that of
/// its beginning, also when it waits over a reload.
#[derive(Clone)]
pub(super) struct Identifier(Arc<Inner>);

struct Inner {
    /// One thread identifies; the lock is never waited for.
    identify: Mutex<Identify>,
    find_load: Option<FindLoad>,
    sha256: String,
    results: ResultOptions,
}

impl Identifier {
    pub(super) fn new(
        identify: Identify,
        find_load: Option<FindLoad>,
        sha256: String,
        results: ResultOptions,
    ) -> Self {
        Self(Arc::new(Inner { identify: Mutex::new(identify), find_load, sha256, results }))
    }

    /// Nothing where no load is looked for.
    pub(super) fn load(
        &self,
        baseline: &Baseline,
        window: &Window,
    ) -> Option<Result<FoundLoad, Refusal>> {
        self.0.find_load.as_ref().map(|find| find(baseline, window))
    }

    pub(super) fn looks_for_loads(&self) -> bool {
        self.0.find_load.is_some()
    }

    pub(super) fn results(&self) -> &ResultOptions {
        &self.0.results
    }

    pub(super) fn sha256(&self) -> &str {
        &self.0.sha256
    }

    pub(super) fn identify(&self, window: &Window) -> Result<Identified, Refusal> {
        let mut identify = self.0.identify.lock().unwrap_or_else(PoisonError::into_inner);
        (*identify)(window)
    }
}

impl core::fmt::Debug for Identifier {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_tuple("Identifier").field(&self.0.sha256).finish()
    }
}

impl core::fmt::Debug for Configuration {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { windows, identify: _, find_load: _, sha256, results: _ } = self;
        f.debug_struct("Configuration")
            .field("windows", windows)
            .field("sha256", sha256)
            .finish_non_exhaustive()
    }
}
