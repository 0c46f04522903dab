//! Payload of an arm during a recording, from a stored result of the arm without it.

use std::ops::Range;

use didim_dynamics::robot::{NamedFrame, NoSuchFrame};
use didim_formats::Measurement;
use didim_identification::identification::{DeclaredLoad, Payload, PayloadError, find_payload};

use super::identify::{IdentifyError, join_measurements, measurement_of};
use super::stored_model::StoredModel;
use crate::archive::drift::Baseline;
use crate::archive::store::FoundLoad;
use crate::cell::Cell;
use crate::window::Window;

/// Error when no load can be identified. The inner errors state the remedy.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The recordings do not fit this robot as an experiment.
    #[error(transparent)]
    Measurement(#[from] IdentifyError),
    /// The result does not identify the arm, or the recording does not identify the load.
    #[error(transparent)]
    Payload(#[from] PayloadError),
    /// The frame of the cell does not exist on its robot.
    #[error(transparent)]
    Frame(#[from] NoSuchFrame),
    /// The baseline has no covariance: an earlier version set it, or its result file was missing.
    /// Set the baseline again.
    #[error(
        "the baseline has no covariance: it was set by an earlier version, or its result was \
            missing; `didim baseline set` sets it again"
    )]
    NoCovariance,
    /// The baseline belongs to another arm, or to another model of the arm. Set a new baseline.
    #[error("the baseline belongs to another robot or model; set a new baseline")]
    OtherModel,
}

/// Identifies the payload during a window, relative to the payload at the identification of the
/// baseline.
///
/// # Errors
/// [`LoadError`].
pub fn find_load(
    cell: &Cell,
    baseline: &Baseline,
    window: &Window,
) -> Result<FoundLoad, LoadError> {
    let line = &baseline.result;
    if line.robot != cell.robot.name() || line.regrouping != cell.regrouping_sha256() {
        return Err(LoadError::OtherModel);
    }
    if baseline.available.covariance.is_none() {
        return Err(LoadError::NoCovariance);
    }
    let noted = window.note.as_ref().and_then(|note| note.payload_kg);
    let declared_kg = noted.map(|kg| kg - line.payload_kg().unwrap_or(0.0));
    let declared = DeclaredLoad { mass_kg: declared_kg, centre_m: None };
    let (measurement, _) = measurement_of(cell, window)?;
    let measured = [(&measurement, window.counted_samples.clone())];
    let frame = cell.load_frame(None)?.frame;
    let payload = StoredModel::of_baseline(baseline).payload(cell, &measured, declared, &frame)?;
    let Payload { presence, load, in_frame, declared, .. } = payload;
    let baseline = line.result;
    let centre_of_mass = in_frame.map(|load| load.centre);
    Ok(FoundLoad { baseline, presence, load, centre_of_mass, declared_kg, declared, changed: None })
}

impl StoredModel {
    /// Identifies the load on the last link from measurements. Uses the samples in each range. The
    /// load is also described in `frame`; the declared centre is in the frame of the last link.
    ///
    /// # Errors
    /// [`LoadError`].
    pub fn payload(
        &self,
        cell: &Cell,
        measurements: &[(&Measurement, Range<usize>)],
        declared: DeclaredLoad,
        frame: &NamedFrame,
    ) -> Result<Payload, LoadError> {
        let experiment = join_measurements(cell, measurements).map_err(IdentifyError::from)?;
        let named = self.named_parameters();
        let arm = self.known_arm(&named);
        let (robot, base, options) = (&cell.robot, &cell.base, &cell.options);
        Ok(find_payload(robot, base, &experiment, options, arm, declared, frame)?)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use didim_identification::identification::ParameterCovariance;

    use super::*;
    use crate::archive::store::{HISTORY_SCHEMA, HistoryLine, ModelContext, Timestamp};
    use crate::window::WindowEnd;

    fn cell() -> Cell {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/cells/tx40-packed-fd.toml");
        Cell::read(&file).unwrap()
    }

    /// Creates a baseline of this robot and model without a covariance.
    fn baseline(cell: &Cell) -> Baseline {
        Baseline::from_result(HistoryLine {
            schema: HISTORY_SCHEMA,
            time: Timestamp::now(),
            recorded: None,
            result: 0,
            cell: cell.name.clone(),
            robot: cell.robot.name().to_owned(),
            configuration: cell.configuration_sha256.clone(),
            regrouping: cell.regrouping_sha256(),
            method: "idim-ls".into(),
            applicable: true,
            monitoring: None,
            uses: Default::default(),
            relative_error: None,
            note: None,
            parameters: Vec::new(),
            against: None,
            load: None,
            day: None,
            readings: Default::default(),
        })
    }

    #[test]
    fn a_baseline_that_shows_no_arm_is_refused_with_what_to_do() {
        let cell = cell();
        let window = Window {
            number: 0,
            sample_rate_hz: cell.sample_rate_hz(),
            samples: Vec::new(),
            counted_samples: 0..0,
            end: WindowEnd::Length,
            recording_start: None,
            note: None,
        };
        let why = |baseline: &Baseline| find_load(&cell, baseline, &window).unwrap_err();
        let plain = baseline(&cell);
        assert!(matches!(why(&plain), LoadError::NoCovariance));
        for change in [
            (|line: &mut HistoryLine| line.robot = "another".into()) as fn(&mut HistoryLine),
            |line| line.regrouping = "another".into(),
        ] {
            let mut other = plain.clone();
            change(&mut other.result);
            assert!(matches!(why(&other), LoadError::OtherModel));
        }
        // With a covariance, the check reaches the samples, of which there are none.
        let covariance: ParameterCovariance =
            serde_json::from_value(serde_json::json!([])).unwrap();
        let context = ModelContext { covariance: Some(covariance), ..ModelContext::default() };
        assert!(!matches!(why(&Baseline { available: context, ..plain }), LoadError::NoCovariance));
    }
}
