//! Parameters that no motion within the joint limits can distinguish.

use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::robot::JointKind;

use super::finding::Finding;
use super::limits::CheckLimits;
use crate::cell::Cell;

/// Number of random motions. They give several times as many equations as an arm with eight joints
/// has parameters.
const RANDOM_MOTIONS: usize = 60;
/// Smallest independent share of a column. Below it, the column is a combination of others.
const MIN_INDEPENDENT_SHARE: f64 = 1e-8;

pub(super) fn check(cell: &Cell, findings: &mut Vec<Finding>) {
    let names = cell.options.parameters.as_deref().unwrap_or(cell.base.names());
    let indices: Vec<usize> = names.iter().filter_map(|name| cell.base.find(name)).collect();
    let columns: Vec<usize> =
        indices.iter().filter_map(|k| cell.base.columns().get(*k).copied()).collect();
    let indistinct: Vec<&str> = indistinct_columns(&cell.model, &columns)
        .into_iter()
        .filter_map(|k| names.get(k).map(String::as_str))
        .collect();
    if indistinct.is_empty() {
        return;
    }
    let still: Vec<String> = (1..)
        .zip(cell.model.chain())
        .filter(|(_, joint)| {
            joint.limits.position_max - joint.limits.position_min < CheckLimits::DEFAULT.min_range
        })
        .map(|(number, _)| number.to_string())
        .collect();
    let because = if still.is_empty() {
        String::new()
    } else {
        format!("; joint {} cannot move", still.join(", "))
    };
    findings.push(Finding::error(
        "identification.parameters",
        format!(
            "no motion within the joint limits distinguishes {} from the parameters \
             before{because}",
            indistinct.join(" ")
        ),
        "list only parameters that the motion distinguishes, or correct the limits in the robot \
        file",
    ));
}

/// Returns the indices of columns that are zero or a combination of earlier ones, over random
/// motions within the limits.
fn indistinct_columns(model: &Model, columns: &[usize]) -> Vec<usize> {
    let model = model.clone().with_plain_friction();
    let selected = model.regressor_columns(columns);
    let (n, p) = (model.joints(), columns.len());
    let mut random = SplitMix64(0x5eed_c4ec_c000_0000);
    let mut workspace = Workspace::new();
    let mut rows = vec![0.0; n * p];
    let mut stacked = vec![Vec::with_capacity(n * RANDOM_MOTIONS); p];
    for _ in 0..RANDOM_MOTIONS {
        let (mut q, mut dq, mut ddq) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        for (k, joint) in model.chain().iter().enumerate() {
            let limits = joint.limits;
            // One turn is enough for an endless joint.
            let reach = match joint.kind {
                JointKind::Revolute => core::f64::consts::PI,
                JointKind::Prismatic => 10.0,
            };
            let (low, high) = (limits.position_min.max(-reach), limits.position_max.min(reach));
            let moves = limits.position_max - limits.position_min >= CheckLimits::DEFAULT.min_range;
            let (low, high) =
                if low <= high { (low, high) } else { (limits.position_min, limits.position_max) };
            q[k] = low + (high - low) * random.unit();
            let speed = if moves { limits.velocity_max.unwrap_or(3.0).min(3.0) } else { 0.0 };
            dq[k] = speed * (2.0 * random.unit() - 1.0);
            ddq[k] = if moves { 10.0 * (2.0 * random.unit() - 1.0) } else { 0.0 };
        }
        // The hysteresis of friction at reversals does not depend on the current state, so a random
        // value is used.
        let share = |_| 2.0 * random.unit() - 1.0;
        workspace.set_hysteresis(Some(core::array::from_fn(share)));
        model.selected_regressor(&mut workspace, &selected, &q, &dq, &ddq, &mut rows);
        for row in rows.chunks_exact(p) {
            for (column, value) in stacked.iter_mut().zip(row) {
                column.push(*value);
            }
        }
    }
    dependent_columns(stacked)
}

/// Returns the dependent columns. Uses Gram-Schmidt: each column is orthogonalised twice against
/// the independent ones before it.
fn dependent_columns(columns: Vec<Vec<f64>>) -> Vec<usize> {
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let mut independent: Vec<Vec<f64>> = Vec::new();
    let mut dependents = Vec::new();
    for (k, mut column) in columns.into_iter().enumerate() {
        let length = dot(&column, &column).sqrt();
        for _ in 0..2 {
            for other in &independent {
                let along = dot(&column, other);
                for (value, part) in column.iter_mut().zip(other) {
                    *value -= along * part;
                }
            }
        }
        let remainder = dot(&column, &column).sqrt();
        if remainder <= MIN_INDEPENDENT_SHARE * length || length == 0.0 {
            dependents.push(k);
        } else {
            column.iter_mut().for_each(|value| *value /= remainder);
            independent.push(column);
        }
    }
    dependents
}

/// Random numbers by SplitMix64 (Steele, Lea and Flood 2014).
struct SplitMix64(u64);

impl SplitMix64 {
    /// Returns a random number in [0, 1).
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        #[expect(clippy::cast_precision_loss, reason = "53 bits fit the mantissa")]
        let number = (z >> 11) as f64;
        number / (1_u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_depend_on_others_are_found() {
        let columns = vec![
            vec![1.0, 0.0, 2.0, 0.0],
            vec![0.0, 0.0, 0.0, 0.0],
            vec![0.0, 1.0, 1.0, 0.0],
            vec![2.0, 3.0, 7.0, 0.0],
            vec![0.0, 0.0, 0.0, 1e-9],
        ];
        assert_eq!(dependent_columns(columns), [1, 3]);
    }
}
