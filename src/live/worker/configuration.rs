//! The part of a running worker's configuration that a reload may change.

use std::sync::{Arc, Mutex, PoisonError};

use didim_identification::identification::Estimate;

use crate::archive::ResultOptions;
use crate::archive::drift::Baseline;
use crate::archive::store::FoundLoad;
use crate::live::window_options::WindowPlan;
use crate::window::Window;

/// Reason why a window could not be identified. The status shows its text.
pub type Refusal = Box<dyn core::error::Error + Send + Sync>;

/// Outcome of a window.
#[derive(Clone, Debug)]
pub struct IdentifiedWindow {
    /// The result.
    pub estimate: Estimate,
}

/// Function that identifies from one window.
pub type Identify = Box<dyn FnMut(&Window) -> Result<IdentifiedWindow, Refusal> + Send>;

/// Function that identifies the payload during a window, relative to that of a baseline.
pub type FindLoad = Arc<dyn Fn(&Baseline, &Window) -> Result<FoundLoad, Refusal> + Send + Sync>;

/// Settings of windows and identification. They change only between two windows.
pub struct Configuration {
    /// Window settings. Their sample rate is that of the stream.
    pub windows: WindowPlan,
    /// Function that identifies a window.
    pub identify: Identify,
    /// Function that identifies the load in a window. `None` if loads are not identified.
    pub find_load: Option<FindLoad>,
    /// Hash of the configuration, for the results.
    pub sha256: String,
    /// Data stored with the results.
    pub results: ResultOptions,
}

/// The identification function of a window, with the hash of its configuration. A window keeps the
/// function that was valid at its beginning, even if the configuration is reloaded while the window
/// is queued.
#[derive(Clone)]
pub(super) struct Identifier(Arc<IdentifierState>);

struct IdentifierState {
    /// Only one thread identifies windows, so it never waits for this lock.
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
        Self(Arc::new(IdentifierState {
            identify: Mutex::new(identify),
            find_load,
            sha256,
            results,
        }))
    }

    /// Identifies the load of a window. `None` if loads are not identified.
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

    pub(super) fn identify(&self, window: &Window) -> Result<IdentifiedWindow, Refusal> {
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
