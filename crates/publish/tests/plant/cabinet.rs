//! What a service leaves and says, written by the library's own writers.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use didim::archive::drift::{AlarmStatus, DriftStatus, ParameterDrift};
use didim::archive::store::{Attachments, ResultRecord, Store, Timestamp};
use didim::live::acquire::SharedAcquisition;
use didim::live::stream::StreamOptions;
use didim::live::worker::SharedEstimation;
use didim::service::paths::Paths;
use didim::service::status::{Collector, Snapshot, Socket, serve_status};
use didim::window::{Window, WindowEnd};
use didim_dynamics::JointSample;
use didim_identification::identification::{Estimate, ParameterEstimate, Verdict};
use tokio::sync::watch;

/// As many as an arm of six axes has.
const PARAMETERS: u32 = 28;

pub(crate) struct Cabinet {
    pub(crate) name: String,
    pub(crate) folder: PathBuf,
    /// What tells its results from those of others.
    number: f64,
    store: Store,
    status: watch::Sender<Arc<[u8]>>,
    snapshot: Snapshot,
    /// Identities of what was stored.
    pub(crate) stored: Vec<String>,
}

impl Cabinet {
    pub(crate) fn new(above: &Path, number: u32) -> Self {
        let name = format!("cabinet-{number}");
        let folder = above.join(&name);
        std::fs::create_dir(&folder).unwrap();
        let options = StreamOptions::new(&name, (&folder, "didim"), 6, 500.0, 1.0).unwrap();
        let shared = (SharedAcquisition::default(), SharedEstimation::default());
        let now = Instant::now();
        let snapshot =
            Collector::new(&options, Some(shared.0), Some(shared.1), None, now).snapshot(now);
        let (status, latest) = watch::channel(json(&snapshot));
        let socket = Paths::with_sockets_in(&folder).status_socket();
        let socket = Socket::listen(&socket, 0o600, None).unwrap();
        std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
            runtime.unwrap().block_on(serve_status(&socket, latest)).map(|never| match never {})
        });
        let store = Store::open(&folder, 100).unwrap();
        Self { name, folder, number: number.into(), store, status, snapshot, stored: Vec::new() }
    }

    /// Stores so many results.
    pub(crate) fn store(&mut self, results: usize) {
        for _ in 0..results {
            #[expect(clippy::cast_precision_loss, reason = "a few")]
            let value = 1000.0 * self.number + self.stored.len() as f64;
            let record = ResultRecord::new(&self.name, "c0ffee", &window(), estimate(value));
            let stored =
                self.store.write(&record, &Attachments::default(), Timestamp::now()).unwrap();
            self.stored.push(stored.line.identity());
        }
    }

    /// Has an alarm in the status, or none.
    pub(crate) fn alarm(&mut self, parameter: Option<&str>) {
        let alarm = |parameter: &str| AlarmStatus {
            description: None,
            parameter: parameter.to_owned(),
            relative_change: Some(0.31),
            deviation_sigma: Some(12.0),
            slope_per_day: None,
            slope_sd: None,
            since: Timestamp::from_unix_s(1_795_331_849),
            text: format!("{parameter} has grown by 31 %"),
        };
        let changed = |k: u32| ParameterDrift {
            parameter: format!("fc{k}"),
            description: None,
            relative_change: Some(f64::from(k) / 7000.0),
            deviation_sigma: Some(f64::from(k) / 7.0),
            band_share: Some(f64::from(k) / 70.0),
        };
        let drift = DriftStatus {
            // As with each result of a service, something differs.
            baseline: self.stored.len() as u64,
            time: Timestamp::from_unix_s(1_795_331_849),
            compared: true,
            why_not: None,
            reconfigured: false,
            parameters: (1..=PARAMETERS).map(changed).collect(),
            alarms: parameter.map(alarm).into_iter().collect(),
        };
        self.snapshot.estimation.as_mut().unwrap().drift = Some(drift);
        self.status.send(json(&self.snapshot)).unwrap();
    }
}

fn json(snapshot: &Snapshot) -> Arc<[u8]> {
    serde_json::to_vec(snapshot).unwrap().into()
}

fn window() -> Window {
    Window {
        number: 0,
        sample_rate_hz: 500.0,
        samples: vec![JointSample::zero(0, 0)],
        counted_samples: 0..1,
        end: WindowEnd::Rest,
        recording_start: None,
        note: None,
    }
}

fn estimate(value: f64) -> Estimate {
    let parameter = |k: u32| ParameterEstimate {
        joint_name: None,
        description: None,
        name: format!("fc{k}"),
        regrouped: false,
        unit: "N·m",
        value: value + f64::from(k) / 10.0,
        standard_deviation: 0.01,
        combined_standard_deviation: 0.1,
        classical_standard_deviation: 0.01,
        relative_standard_deviation: 0.001,
    };
    let mut verdict = Verdict { applicable: true, ..Verdict::default() };
    verdict.uses.monitoring.applicable = Some(true);
    Estimate {
        schema: 1,
        method: "idim-ls".into(),
        robot: "tx40".into(),
        parameters: (1..=PARAMETERS).map(parameter).collect(),
        relative_error: 0.05,
        verdict,
        ..Estimate::default()
    }
}
