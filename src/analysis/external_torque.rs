//! External torque along a recording, and the observer of a running service.

use didim_dynamics::robot::{Joint, JointIndex};
use didim_formats::{Measurement, Side};
use didim_identification::external_torque::{
    ExternalTorque, ExternalTorqueObserver, ObserverError, ObserverOptions, ObserverSignals,
    ObserverState,
};
use serde::Serialize;

use super::counted::CountedPiece;
use super::stored_model::StoredModel;
use crate::cell::Cell;

/// External torque at one sample.
#[derive(Clone, Debug, PartialEq)]
pub struct ExternalTorqueRow {
    /// Time since the first sample of the file \[s\].
    pub time_s: f64,
    /// The estimate.
    pub estimate: ExternalTorque,
}

/// External torque of one joint over a recording, over the samples with a usable estimate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointExternalTorque {
    /// Number of the joint.
    pub joint: JointIndex,
    /// Name of the joint in the robot file. `None` if it has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint_name: Option<String>,
    /// Unit of the torques: `N·m`, or `N` of a prismatic joint.
    pub unit: &'static str,
    /// Root mean square of the external torque.
    pub rms: f64,
    /// Root mean square of its standard deviation.
    pub standard_deviation: f64,
    /// Largest external torque in standard deviations, with its sign in `at_largest`.
    pub largest_ratio: f64,
    /// External torque at that sample.
    pub at_largest: f64,
    /// Standard deviation at that sample.
    pub standard_deviation_at_largest: f64,
    /// Time of that sample since the first \[s\].
    pub at_s: f64,
}

/// External torque over a recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExternalTorqueSummary {
    /// Bandwidth of the observer \[Hz\].
    pub bandwidth_hz: f64,
    /// Number of samples with a usable estimate.
    pub samples: usize,
    /// Number of samples outside the motion of the identification.
    pub outside_motion: usize,
    /// Number of samples in which the observer settles.
    pub settling: usize,
    /// One entry for each joint with a recorded torque. Empty without a usable estimate.
    pub joints: Vec<JointExternalTorque>,
}

/// Returns the bandwidth of the identified rows \[Hz\]: the standard deviation of the residuals is
/// known in this band.
pub fn identified_bandwidth_hz(cell: &Cell) -> f64 {
    let filter = &cell.options.decimation_filter;
    #[expect(clippy::cast_precision_loss, reason = "a factor far below 2^52")]
    let rows_hz = cell.sample_rate_hz() / filter.factor.max(1) as f64;
    0.5 * filter.cutoff_ratio * rows_hz
}

impl StoredModel {
    /// Creates the momentum observer of the cell's arm, for signals of one side of the
    /// transmission. Without a bandwidth it has that of the identified rows.
    ///
    /// # Errors
    /// [`ObserverError`].
    pub fn observer(
        &self,
        cell: &Cell,
        side: Side,
        bandwidth_hz: Option<f64>,
    ) -> Result<ExternalTorqueObserver, ObserverError> {
        let named = self.named_parameters();
        let transmission = cell.robot.transmission();
        let signals = ObserverSignals {
            sample_rate_hz: cell.sample_rate_hz(),
            transmission: (side == Side::Motor).then(|| transmission.clone()),
            torque_timing: cell.torque_timing,
            delays: cell.signal_delays.clone(),
        };
        let options = ObserverOptions {
            bandwidth_hz: bandwidth_hz.unwrap_or_else(|| identified_bandwidth_hz(cell)),
            noise: self.residual_rms.clone(),
            reached: self.reached.clone(),
        };
        let arm = self.known_arm(&named);
        ExternalTorqueObserver::new(&cell.robot, &cell.base, &arm, signals, options)
    }

    /// Estimates the external torque along the samples of a recording that count. `each` receives
    /// every row in turn.
    ///
    /// # Errors
    /// [`ObserverError`], or the error of `each`.
    pub fn external_torque<E: From<ObserverError>>(
        &self,
        cell: &Cell,
        parts: &[CountedPiece],
        bandwidth_hz: Option<f64>,
        mut each: impl FnMut(&ExternalTorqueRow) -> Result<(), E>,
    ) -> Result<ExternalTorqueSummary, E> {
        let joints = cell.robot.joints();
        let mut tally = Tally { joints: vec![JointTally::default(); joints], ..Tally::default() };
        for CountedPiece { piece, counted_range, .. } in parts {
            let measurement = &piece.measurement;
            let mut observer = self.observer(cell, measurement.side, bandwidth_hz)?;
            // The observer sees the margin as well, and settles there.
            for sample in 0..counted_range.end {
                let [position, torque] = axes_at(measurement, sample);
                let estimate = observer.step(sample as u64, &position, &torque);
                let Some(estimate) = estimate.filter(|_| counted_range.contains(&sample)) else {
                    continue;
                };
                let time_s = piece.time_s(sample);
                let row = ExternalTorqueRow { time_s, estimate: *estimate };
                tally.add(&row);
                each(&row)?;
            }
        }
        let bandwidth_hz = bandwidth_hz.unwrap_or_else(|| identified_bandwidth_hz(cell));
        Ok(tally.summary(cell, bandwidth_hz))
    }
}

/// Returns position and torque of all axes at a sample.
fn axes_at(measurement: &Measurement, sample: usize) -> [Vec<f64>; 2] {
    let signals = &measurement.signals;
    [&signals.position_rad, &signals.torque_nm]
        .map(|of| of.iter().map(|axis| axis[sample]).collect())
}

/// Sums over the rows so far.
#[derive(Default)]
struct Tally {
    samples: usize,
    outside_motion: usize,
    settling: usize,
    joints: Vec<JointTally>,
}

#[derive(Clone, Default)]
struct JointTally {
    squares: f64,
    variances: f64,
    largest_ratio: f64,
    at_largest: [f64; 3],
}

impl Tally {
    fn add(&mut self, row: &ExternalTorqueRow) {
        match row.estimate.state {
            ObserverState::Settling => self.settling += 1,
            ObserverState::OutsideMotion(_) => self.outside_motion += 1,
            ObserverState::Settled => {
                self.samples += 1;
                let ExternalTorque { torque, standard_deviation, .. } = &row.estimate;
                for ((tally, torque), deviation) in
                    self.joints.iter_mut().zip(torque).zip(standard_deviation)
                {
                    tally.squares += torque * torque;
                    tally.variances += deviation * deviation;
                    let ratio = torque.abs() / deviation;
                    if ratio > tally.largest_ratio {
                        tally.largest_ratio = ratio;
                        tally.at_largest = [*torque, *deviation, row.time_s];
                    }
                }
            }
        }
    }

    fn summary(self, cell: &Cell, bandwidth_hz: f64) -> ExternalTorqueSummary {
        let Self { samples, outside_motion, settling, joints } = self;
        #[expect(clippy::cast_precision_loss, reason = "samples are far fewer than 2^52")]
        let count = samples as f64;
        let recorded = cell.robot.recorded_torque();
        let joints = joints.into_iter().zip(cell.robot.chain()).enumerate();
        let joints = joints.filter(|(joint, _)| recorded.has_joint(JointIndex::new(*joint)));
        let joints = if samples > 0 {
            joints
                .map(|(joint, (tally, described))| tally.summary(cell, (joint, described), count))
                .collect()
        } else {
            Vec::new()
        };
        ExternalTorqueSummary { bandwidth_hz, samples, outside_motion, settling, joints }
    }
}

impl JointTally {
    /// Returns the figures of a joint, counted from 0, over this number of samples.
    fn summary(
        &self,
        cell: &Cell,
        (joint, described): (usize, &Joint),
        samples: f64,
    ) -> JointExternalTorque {
        let [at_largest, deviation, at_s] = self.at_largest;
        JointExternalTorque {
            joint: JointIndex::new(joint),
            joint_name: cell.robot.joint_name(JointIndex::new(joint)).map(str::to_owned),
            unit: described.kind.torque_unit(),
            rms: (self.squares / samples).sqrt(),
            standard_deviation: (self.variances / samples).sqrt(),
            largest_ratio: self.largest_ratio,
            at_largest,
            standard_deviation_at_largest: deviation,
            at_s,
        }
    }
}
