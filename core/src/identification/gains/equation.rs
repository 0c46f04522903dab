//! What two records say of the gains, a drive at a time.

use nalgebra::{DMatrix, DVector};

use super::error::GainsError;
use super::load::KnownLoad;
use crate::MAX_JOINTS;
use crate::identification::given::Context;
use crate::identification::observation::{
    BaseColumns, filtered_motion, filtered_torque, torque_equation,
};
use crate::robot::{ParameterKind, Transmission};

/// Of the inertias of a load, what is smaller than this share of the largest is none.
const RANK: f64 = 1e-9;

/// `g_k t_k = U_k u + l_k` with the rows of drive 1 first, then drive 2, …: t is what is measured with the stated gains, g by how
/// much these are wrong, u are the arm's base parameters and what is not known of the load, l the torque that is known.
pub(super) struct Equation {
    pub(super) drives: usize,
    /// t (r).
    pub(super) torque: DVector<f64>,
    /// U (r × m): the base parameters that are identified, then the load's inertia.
    pub(super) unknown: DMatrix<f64>,
    /// l (r).
    pub(super) known: DVector<f64>,
    /// What moments of the load would do (r × 3).
    pub(super) moments: DMatrix<f64>,
    /// Without a load the drive whose gain is taken for 1, from 0.
    pub(super) reference: Option<usize>,
}

/// A load, and the first sample of an experiment with it.
pub(super) type Carried = (KnownLoad, usize);

impl Equation {
    /// Along an experiment whose samples from some on are those with the load. Torques are those of the motors of a
    /// transmission, or of the joints.
    pub(super) fn new(
        context: &Context<'_>,
        carried: Option<Carried>,
        transmission: Option<&Transmission>,
    ) -> Result<Self, GainsError> {
        let Context { robot, base, selection, .. } = context;
        let motion =
            filtered_motion(context.robot, context.experiment, &context.options.position_filter)?;
        let BaseColumns { selected, beside } = BaseColumns::new(context, &motion)?;
        let arm = torque_equation(context, selected, filtered_torque(context)?, &motion)?;
        let matrix = arm.matrix().dense();

        let vector = |of: DVector<f64>| DMatrix::from_column_slice(of.len(), 1, of.as_slice());
        let of_drives = |rows: DMatrix<f64>| match transmission {
            None => rows,
            Some(transmission) => of_motors(&rows, transmission, arm.rows_per_joint()),
        };
        let measured = of_drives(vector(arm.measured().into_owned())).column(0).into_owned();
        let Some((load, first_loaded)) = carried else {
            if arm.known().is_some() {
                return Err(GainsError::KnownTorque);
            }
            let rows = measured.len();
            let mut equation = Self {
                drives: robot.joints(),
                torque: measured,
                unknown: of_drives(matrix),
                known: DVector::zeros(rows),
                moments: DMatrix::zeros(rows, 0),
                reference: None,
            };
            equation.reference = equation.least_noisy();
            return Ok(equation);
        };

        // The load regroups into all base parameters, whichever are identified.
        let left_out = base.columns().iter().filter(|column| !selection.columns().contains(column));
        let order = selection.columns().iter().chain(left_out);
        let order: Vec<usize> =
            order.filter_map(|column| base.columns().binary_search(column).ok()).collect();
        let last = robot.joints() - 1;
        let column = |kind| robot.parameters().column(kind, last);
        let ten: Vec<usize> = ParameterKind::LINK.into_iter().filter_map(column).collect();
        let change = base.regrouping().select_rows(&order).select_columns(&ten);
        let own = matrix.ncols();
        let mut of_load = &matrix * change.rows(0, own);
        of_load += beside.left_out.dense() * change.rows(own, order.len() - own);
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
        let inertia = basis(&of_load.columns(0, 6).into_owned());
        let mut unknown = matrix.resize_horizontally(own + inertia.ncols(), 0.0);
        unknown.columns_mut(own, inertia.ncols()).copy_from(&inertia);

        let known = arm.known().map_or_else(|| weight.clone(), |known| known + &weight);
        Ok(Self {
            drives: robot.joints(),
            torque: measured,
            unknown: of_drives(unknown),
            known: of_drives(vector(known)).column(0).into_owned(),
            moments: of_drives(basis(&of_load.columns(6, 3).into_owned())),
            reference: None,
        })
    }

    /// R of the rows of a drive, \[U t\], with the known torque \[U l t\]: its last entry is what they leave of the drive's torque. None where they
    /// are too few.
    pub(super) fn triangle(&self, drive: usize, with_known: bool) -> Option<DMatrix<f64>> {
        let (rows, unknowns) = (self.rows_per_drive(), self.unknown.ncols());
        let (first, own) = (drive * rows, unknowns + usize::from(with_known));
        let mut block = DMatrix::zeros(rows, own + 1);
        block.columns_mut(0, unknowns).copy_from(&self.unknown.rows(first, rows));
        if with_known {
            block.set_column(unknowns, &self.known.rows(first, rows));
        }
        block.set_column(own, &self.torque.rows(first, rows));
        (rows > own).then(|| block.qr().unpack_r())
    }

    /// The drive of whose torque its own rows leave the smallest share.
    fn least_noisy(&self) -> Option<usize> {
        let (rows, own) = (self.rows_per_drive(), self.unknown.ncols());
        let share = |drive: usize| {
            let left = self.triangle(drive, false)?[(own, own)].abs();
            Some(left / self.torque.rows(drive * rows, rows).norm())
                .filter(|share| share.is_finite())
        };
        let told = (0..self.drives).filter_map(|drive| Some((drive, share(drive)?)));
        told.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(drive, _)| drive)
    }

    /// The drives whose gains are unknown, from 0.
    pub(super) fn free(&self) -> Vec<usize> {
        (0..self.drives).filter(|drive| Some(*drive) != self.reference).collect()
    }

    /// Rows N of each drive.
    pub(super) fn rows_per_drive(&self) -> usize {
        self.torque.len() / self.drives
    }

    /// U u + l (r).
    pub(super) fn arm(&self, unknowns: &DVector<f64>) -> DVector<f64> {
        &self.unknown * unknowns + &self.known
    }
}

/// R⁻ᵀ times the rows of the joints.
fn of_motors(rows: &DMatrix<f64>, transmission: &Transmission, per_joint: usize) -> DMatrix<f64> {
    let joints = rows.nrows() / per_joint;
    let mut moved = DMatrix::zeros(rows.nrows(), rows.ncols());
    for joint in 0..joints {
        let (mut unit, mut shares) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
        unit[joint] = 1.0;
        transmission.motor_torque(&unit[..joints], &mut shares[..joints]);
        for (motor, share) in shares[..joints].iter().enumerate().filter(|(_, of)| **of != 0.0) {
            let mut to = moved.rows_mut(motor * per_joint, per_joint);
            to += rows.rows(joint * per_joint, per_joint) * *share;
        }
    }
    moved
}

/// Orthonormal columns that span these.
fn basis(columns: &DMatrix<f64>) -> DMatrix<f64> {
    let scaled: Vec<_> = columns
        .column_iter()
        .filter(|column| column.norm() > 0.0)
        .map(|column| column.normalize())
        .collect();
    if scaled.is_empty() {
        return DMatrix::zeros(columns.nrows(), 0);
    }
    let qr = DMatrix::from_columns(&scaled).qr();
    // Their singular vectors, by a small matrix.
    let singular = qr.r().svd(true, false);
    let Some(u) = singular.u else { return DMatrix::zeros(columns.nrows(), 0) };
    let largest = singular.singular_values.max();
    let own = (0..u.ncols()).filter(|k| singular.singular_values[*k] > RANK * largest);
    qr.q() * u.select_columns(&own.collect::<Vec<_>>())
}
