//! Equation of the gains from two records, one drive at a time.

use nalgebra::{DMatrix, DVector};

use super::error::GainsError;
use super::load::KnownLoad;
use crate::identification::observation::{
    BaseColumns, filtered_motion, filtered_torque, torque_equation,
};
use crate::identification::problem::Context;
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::robot::{JointIndex, ParameterKind, Transmission};

/// Smallest singular value of the load's inertia columns that is not treated as zero, relative to
/// the largest.
const RANK_TOLERANCE: f64 = 1e-9;

/// Equation `g_k t_k = U_k u + l_k`, with the rows of drive 1 first, then drive 2, …. t is the
/// torque with the configured gains and g the correction of these gains. u contains the arm's base
/// parameters and the unknowns of the load, l is the known torque.
pub(super) struct Equation {
    pub(super) drive_count: usize,
    /// Torque t with the configured gains (r).
    pub(super) torque: DVector<f64>,
    /// U (r × m): columns of the identified base parameters, then of the load's inertia.
    pub(super) unknown_columns: DMatrix<f64>,
    /// Known torque l (r).
    pub(super) known_torque: DVector<f64>,
    /// Torques of the load's first moments (r × 3).
    pub(super) load_moments: DMatrix<f64>,
    /// Without a load, the drive whose gain is assumed to be 1, counted from 0.
    pub(super) reference: Option<usize>,
}

/// Load, and the first sample of the experiment with the load.
pub(super) type LoadRows = (KnownLoad, usize);

impl Equation {
    /// Creates the equation of an experiment; `load_rows` marks the samples with the load. Torques
    /// are those of the motors if there is a transmission, otherwise those of the joints.
    pub(super) fn new(
        context: &Context<'_>,
        load_rows: Option<LoadRows>,
        transmission: Option<&Transmission>,
    ) -> Result<Self, GainsError> {
        let Context { robot, base, selection, .. } = context;
        let motion =
            filtered_motion(context.robot, context.experiment, &context.options.position_filter)?;
        let BaseColumns { selected, auxiliary } = BaseColumns::new(context, &motion)?;
        let arm = torque_equation(context, selected, filtered_torque(context)?, &motion)?;
        let matrix = arm.matrix().dense();

        let vector = |of: DVector<f64>| DMatrix::from_column_slice(of.len(), 1, of.as_slice());
        let of_drives = |rows: DMatrix<f64>| match transmission {
            None => rows,
            Some(transmission) => of_motors(&rows, transmission, arm.rows_per_joint()),
        };
        let measured = of_drives(vector(arm.measured_values().into_owned())).column(0).into_owned();
        let Some((load, first_loaded)) = load_rows else {
            if arm.known_torque().is_some() {
                return Err(GainsError::KnownTorque);
            }
            let rows = measured.len();
            let mut equation = Self {
                drive_count: robot.joints(),
                torque: measured,
                unknown_columns: of_drives(matrix),
                known_torque: DVector::zeros(rows),
                load_moments: DMatrix::zeros(rows, 0),
                reference: None,
            };
            equation.reference = equation.least_noisy();
            return Ok(equation);
        };

        // The load is regrouped into all base parameters, including unidentified ones.
        let left_out = base.columns().iter().filter(|column| !selection.columns().contains(column));
        let order = selection.columns().iter().chain(left_out);
        let order: Vec<usize> =
            order.filter_map(|column| base.columns().binary_search(column).ok()).collect();
        let last = robot.joints() - 1;
        let column = |kind| robot.parameters().column(kind, JointIndex::new(last));
        let ten: Vec<usize> = ParameterKind::LINK.into_iter().filter_map(column).collect();
        let change = base.regrouping().select_rows(&order).select_columns(&ten);
        let width = matrix.ncols();
        let mut of_load = &matrix * change.rows(0, width);
        of_load += auxiliary.left_out.dense() * change.rows(width, order.len() - width);
        let per_joint = arm.rows_per_joint();
        for (row, mut values) in of_load.row_iter_mut().enumerate() {
            if context.samples[row % per_joint] < first_loaded {
                values.fill(0.0);
            }
        }
        let KnownLoad { mass_kg, centre_m: [x, y, z] } = load;
        let weight = of_load.columns(6, 4) * DVector::from_vec(vec![x, y, z, 1.0]) * mass_kg;
        if weight.amax() <= 0.0 {
            return Err(GainsError::Unseen);
        }
        let inertia = orthonormal_basis(&of_load.columns(0, 6).into_owned());
        let mut unknown = matrix.resize_horizontally(width + inertia.ncols(), 0.0);
        unknown.columns_mut(width, inertia.ncols()).copy_from(&inertia);

        let known_sum = arm.known_torque().map_or_else(|| weight.clone(), |sum| sum + &weight);
        Ok(Self {
            drive_count: robot.joints(),
            torque: measured,
            unknown_columns: of_drives(unknown),
            known_torque: of_drives(vector(known_sum)).column(0).into_owned(),
            load_moments: of_drives(orthonormal_basis(&of_load.columns(6, 3).into_owned())),
            reference: None,
        })
    }

    /// Returns the triangular factor R of a drive's rows: of \[U t\], or of \[U l t\] with the
    /// known torque. Its last entry is the residual of the drive's torque. Returns `None` if there
    /// are too few rows.
    pub(super) fn triangular_factor(&self, drive: usize, with_known: bool) -> Option<DMatrix<f64>> {
        let (rows, unknowns) = (self.rows_per_drive(), self.unknown_columns.ncols());
        let (first, own) = (drive * rows, unknowns + usize::from(with_known));
        let mut block = DMatrix::zeros(rows, own + 1);
        block.columns_mut(0, unknowns).copy_from(&self.unknown_columns.rows(first, rows));
        if with_known {
            block.set_column(unknowns, &self.known_torque.rows(first, rows));
        }
        block.set_column(own, &self.torque.rows(first, rows));
        (rows > own).then(|| block.qr().unpack_r())
    }

    /// Returns the drive with the smallest relative residual in its own rows.
    fn least_noisy(&self) -> Option<usize> {
        let (rows, own) = (self.rows_per_drive(), self.unknown_columns.ncols());
        let share = |drive: usize| {
            let remainder = self.triangular_factor(drive, false)?[(own, own)].abs();
            Some(remainder / self.torque.rows(drive * rows, rows).norm())
                .filter(|share| share.is_finite())
        };
        let identifiable = (0..self.drive_count).filter_map(|drive| Some((drive, share(drive)?)));
        identifiable.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(drive, _)| drive)
    }

    /// Returns the drives with unknown gains, from 0.
    pub(super) fn drives_with_free_gain(&self) -> Vec<usize> {
        (0..self.drive_count).filter(|drive| Some(*drive) != self.reference).collect()
    }

    /// Returns the number of rows N of each drive.
    pub(super) fn rows_per_drive(&self) -> usize {
        self.torque.len() / self.drive_count
    }

    /// Returns U u + l (r).
    pub(super) fn arm_torque(&self, unknowns: &DVector<f64>) -> DVector<f64> {
        &self.unknown_columns * unknowns + &self.known_torque
    }
}

/// Converts rows of the joints to rows of the motors by R⁻ᵀ.
fn of_motors(rows: &DMatrix<f64>, transmission: &Transmission, per_joint: usize) -> DMatrix<f64> {
    let joints = rows.nrows() / per_joint;
    let mut by_motor = DMatrix::zeros(rows.nrows(), rows.ncols());
    for joint in 0..joints {
        let (mut unit, mut shares) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
        unit[joint] = 1.0;
        transmission.motor_torque(&unit[..joints], &mut shares[..joints]);
        for (motor, share) in shares[..joints].iter().enumerate().filter(|(_, of)| **of != 0.0) {
            let mut target = by_motor.rows_mut(motor * per_joint, per_joint);
            target += rows.rows(joint * per_joint, per_joint) * *share;
        }
    }
    by_motor
}

/// Returns orthonormal columns that span the same space.
fn orthonormal_basis(columns: &DMatrix<f64>) -> DMatrix<f64> {
    let scaled: Vec<_> = columns
        .column_iter()
        .filter(|column| column.norm() > 0.0)
        .map(|column| column.normalize())
        .collect();
    if scaled.is_empty() {
        return DMatrix::zeros(columns.nrows(), 0);
    }
    let qr = DMatrix::from_columns(&scaled).qr();
    // Singular vectors of the columns, computed from the small matrix R.
    let singular = qr.r().svd(true, false);
    let Some(u) = singular.u else { return DMatrix::zeros(columns.nrows(), 0) };
    let largest = singular.singular_values.max();
    let significant =
        (0..u.ncols()).filter(|k| singular.singular_values[*k] > RANK_TOLERANCE * largest);
    qr.q() * u.select_columns(&significant.collect::<Vec<_>>())
}
