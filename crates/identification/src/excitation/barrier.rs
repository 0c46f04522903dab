//! Barrier that keeps a motion within its limits, with its gradient.

use nalgebra::DMatrix;

use super::basis::{Motion, column};
use super::bounds::Bounds;
use super::limit_kind::LimitKind;
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::dynamics::{Model, Workspace};

/// Barrier −ln(1 − z²), averaged over the samples and summed over the limits. z is the used share
/// of a limit, from −1 to 1.
pub(super) struct Barrier<'a> {
    model: &'a Model,
    bounds: &'a Bounds,
    workspace: Workspace<f64>,
}

impl<'a> Barrier<'a> {
    pub(super) fn new(model: &'a Model, bounds: &'a Bounds) -> Self {
        Self { model, bounds, workspace: Workspace::new() }
    }

    /// Returns the model of the arm.
    pub(super) fn model(&self) -> &Model {
        self.model
    }

    /// Returns the torques along a motion, n × N; `None` if torques are not limited.
    pub(super) fn torques_along(&mut self, [q, dq, ddq, _]: &Motion) -> Option<DMatrix<f64>> {
        let parameters = self.bounds.parameters.as_ref()?;
        let mut torques = DMatrix::zeros(q.nrows(), q.ncols());
        for (i, mut torque) in torques.column_iter_mut().enumerate() {
            self.model.inverse_dynamics(
                &mut self.workspace,
                parameters,
                column(q, i),
                column(dq, i),
                column(ddq, i),
                torque.as_mut_slice(),
            );
        }
        Some(torques)
    }

    /// Returns the largest used share of any limit, and the index of the limit; `None` if it is a
    /// gap.
    pub(super) fn largest_share(
        &self,
        motion: &Motion,
        torques: Option<&DMatrix<f64>>,
    ) -> (Option<usize>, f64) {
        let shares = self.bounds.limits.iter().enumerate().filter_map(|(place, bound)| {
            let values = of_kind(bound.kind, motion, torques)?;
            let shares = (0..values.ncols()).map(|i| bound.share_of_limit(column(values, i)).abs());
            Some((place, shares.fold(0.0, f64::max)))
        });
        let (place, share) = shares.max_by(|a, b| a.1.total_cmp(&b.1)).unzip();
        let share = share.unwrap_or(0.0);
        let of_gaps = self
            .bounds
            .shapes
            .as_ref()
            .map_or(0.0, |of| of.largest_gap_share(self.model, &motion[0]));
        if of_gaps > share { (None, of_gaps) } else { (place, share) }
    }

    /// Returns the barrier times `weight`, and adds its gradient to `by_motion`. Returns `None`
    /// outside a limit.
    pub(super) fn add_share(
        &mut self,
        weight: f64,
        motion: &Motion,
        by_motion: &mut Motion,
    ) -> Option<f64> {
        let torques = self.torques_along(motion);
        let weight = weight / motion[0].ncols() as f64;
        let mut value = 0.0;
        let mut by_torque = torques.as_ref().map(|of| DMatrix::zeros(of.nrows(), of.ncols()));
        for bound in &self.bounds.limits {
            let Some(values) = of_kind(bound.kind, motion, torques.as_ref()) else { continue };
            let gradient = match bound.kind {
                LimitKind::Position => &mut by_motion[0],
                LimitKind::Speed => &mut by_motion[1],
                LimitKind::Acceleration => &mut by_motion[2],
                LimitKind::Jerk => &mut by_motion[3],
                LimitKind::Torque => by_torque.as_mut()?,
            };
            for (i, mut gradient) in gradient.column_iter_mut().enumerate() {
                let z = bound.share_of_limit(column(values, i));
                let slack = 1.0 - z * z;
                if slack.is_nan() || slack <= 0.0 {
                    return None;
                }
                value -= weight * slack.ln();
                let slope = weight * 2.0 * z / (slack * bound.half_range);
                for (joint, factor) in &bound.terms {
                    gradient[*joint] += slope * factor;
                }
            }
        }
        if let Some(shapes) = &self.bounds.shapes {
            for (i, mut gradient) in by_motion[0].column_iter_mut().enumerate() {
                let q = column(&motion[0], i);
                value += shapes.add(self.model, weight, q, gradient.as_mut_slice())?;
            }
        }
        if let Some(by_torque) = by_torque {
            self.add_of_torques(motion, &by_torque, by_motion);
        }
        Some(value)
    }

    /// Converts the gradient with respect to the torques to the gradient with respect to the
    /// motion, and adds it.
    fn add_of_torques(
        &mut self,
        [q, dq, ddq, _]: &Motion,
        by_torque: &DMatrix<f64>,
        by_motion: &mut Motion,
    ) {
        let Some(parameters) = self.bounds.parameters.as_ref() else { return };
        let n = q.nrows();
        let mut partials = [[0.0; MAX_JOINTS * MAX_JOINTS]; 3];
        let [by_q, by_dq, by_ddq] = &mut partials;
        let (by_q, by_dq, by_ddq) = (&mut by_q[..n * n], &mut by_dq[..n * n], &mut by_ddq[..n * n]);
        for i in 0..q.ncols() {
            let (q, dq, ddq) = (column(q, i), column(dq, i), column(ddq, i));
            let ws = &mut self.workspace;
            self.model.inverse_dynamics_partials(ws, parameters, q, dq, ddq, by_q, by_dq);
            self.model.mass_matrix(ws, parameters, q, by_ddq);
            for (j, by_torque) in column(by_torque, i).iter().enumerate() {
                let row = j * n..(j + 1) * n;
                for (gradient, partials) in by_motion.iter_mut().zip([&*by_q, &*by_dq, &*by_ddq]) {
                    for (to, partial) in
                        gradient.column_mut(i).iter_mut().zip(&partials[row.clone()])
                    {
                        *to += by_torque * partial;
                    }
                }
            }
        }
    }
}

/// Returns the values of the quantity that a kind of limit applies to, n × N.
fn of_kind<'a>(
    kind: LimitKind,
    [q, dq, ddq, dddq]: &'a Motion,
    torques: Option<&'a DMatrix<f64>>,
) -> Option<&'a DMatrix<f64>> {
    match kind {
        LimitKind::Position => Some(q),
        LimitKind::Speed => Some(dq),
        LimitKind::Acceleration => Some(ddq),
        LimitKind::Jerk => Some(dddq),
        LimitKind::Torque => torques,
    }
}
