//! Section `[contact]` of a cell file.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Deserialize;

/// `[contact]`
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactSection {
    /// The result file whose parameters explain the torques.
    ///
    /// If left out: the newest result of the service that is usable for prediction.
    #[serde(default)]
    pub result: Option<PathBuf>,
    /// Bandwidth of the external torque \[Hz\]: more than 0, less than half of the sample rate. A
    /// contact shows after 1 / (2π bandwidth).
    ///
    /// If left out: that of the identified rows, `cutoff_ratio` of half their rate.
    #[serde(default)]
    pub bandwidth_hz: Option<f64>,
}

impl ContactSection {
    /// Checks the bandwidth against the sample rate \[Hz\]. Returns the problem of
    /// `contact.bandwidth_hz`.
    pub(super) fn check(&self, sample_rate_hz: f64) -> Result<(), String> {
        let most = 0.5 * sample_rate_hz;
        match self.bandwidth_hz {
            Some(hz) if !(hz > 0.0 && hz < most) => Err(format!(
                "{hz} has to be more than 0 and less than {most}, half the sample rate"
            )),
            _ => Ok(()),
        }
    }

    /// Returns the section with paths relative to the cell file resolved.
    pub(super) fn resolved(self, cell: &Path) -> Self {
        let folder = cell.parent().unwrap_or(Path::new(""));
        Self { result: self.result.map(|file| folder.join(file)), ..self }
    }
}
