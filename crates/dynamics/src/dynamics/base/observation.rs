//! Columns of the regressor, stacked over random motions.

use nalgebra::DMatrix;

use crate::dynamics::model::Model;
use crate::dynamics::workspace::Workspace;
use crate::robot::JointKind;

/// Seed of the random motions. It is the same for every robot, so that the same robot always has
/// the same base parameters.
const SEED: u64 = 0x5eed_0fb0_dd1e_5000;

/// SplitMix64 (Steele, Lea and Flood 2014): well distributed, and the same on every platform.
struct SplitMix64(u64);

impl SplitMix64 {
    fn uniform(&mut self, size: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        // The upper 52 bits, as a number in [-1, 1).
        #[allow(clippy::cast_precision_loss, reason = "52 bits fit the mantissa")]
        let unit = (z >> 12) as f64 / (1_u64 << 51) as f64 - 1.0;
        size * unit
    }
}

/// Returns the stacked regressors of random motions, as many as there are parameters. Rows of
/// joints without a recorded torque are 0.
pub(super) fn random_observation(model: &Model) -> DMatrix<f64> {
    let model = model.clone().with_plain_friction();
    let (n, p) = (model.joints(), model.parameter_names().len());
    let mut random = SplitMix64(SEED);
    let mut workspace = Workspace::new();
    let mut regressor = vec![0.0; n * p];
    let mut stacked = DMatrix::zeros(n * p, p);
    for sample in 0..p {
        let range = |kind| match kind {
            JointKind::Revolute => core::f64::consts::PI,
            JointKind::Prismatic => 1.0,
        };
        let q: Vec<f64> = model.chain().iter().map(|j| random.uniform(range(j.kind))).collect();
        let dq: Vec<f64> = (0..n).map(|_| random.uniform(3.0)).collect();
        let ddq: Vec<f64> = (0..n).map(|_| random.uniform(10.0)).collect();
        // The state does not determine the hysteresis of friction.
        let share = |joint: usize| ((sample * n + joint) as f64).sin();
        workspace.set_hysteresis(Some(core::array::from_fn(share)));
        model.regressor(&mut workspace, &q, &dq, &ddq, &mut regressor);
        for joint in model.missing_torques() {
            regressor[joint.position() * p..][..p].fill(0.0);
        }
        stacked.rows_mut(sample * n, n).copy_from(&DMatrix::from_row_slice(n, p, &regressor));
    }
    stacked
}
