//! Computation of the generated code, recorded from the library's own algorithms.

use didim_dynamics::dynamics::{BaseParameters, Model, Workspace};
use didim_dynamics::numeric::Scalar;
use didim_dynamics::robot::{FrictionLaw, JointIndex, ParameterKind, Robot};
use nalgebra::{Cholesky, DMatrix};

use super::error::CodeError;
use super::statements::{Language, statements};
use super::tape::{Tape, Traced, trace};

/// A model to write as code.
#[derive(Clone, Copy, Debug)]
pub struct CodeModel<'a> {
    /// Its geometry, drives and friction laws.
    pub robot: &'a Robot,
    /// Its base parameters.
    pub base: &'a BaseParameters,
    /// A value for each standard parameter.
    pub standard_parameters: &'a [f64],
    /// The base parameters that were identified, by name.
    pub identified_names: &'a [&'a str],
    /// Their covariance (b × b).
    pub covariance: &'a DMatrix<f64>,
    /// Provenance, one entry per line.
    pub origin: &'a [String],
}

/// A function of the generated code: of position, velocity and acceleration.
struct Function {
    tape: Tape,
    results: Vec<usize>,
}

/// The generated computation, independent of a language.
pub(super) struct Program<'a> {
    pub(super) model: CodeModel<'a>,
    pub(super) prefix: String,
    rigid_body: Function,
    gravity: Function,
    friction: Function,
    regressor: Function,
    /// Row and column of each entry of the regressor.
    pub(super) entries: Vec<(usize, usize)>,
    /// Lower triangle L of the covariance LLᵀ, row by row.
    pub(super) factor: Vec<f64>,
    pub(super) checks: Vec<SelfTestPoint>,
}

/// A state, and the library's results at it.
pub(super) struct SelfTestPoint {
    /// q, q̇ and q̈, joint by joint.
    pub(super) state: [Vec<f64>; 3],
    pub(super) torque: Vec<f64>,
    /// Diagonal of the torque's covariance.
    pub(super) variance: Vec<f64>,
}

/// Function of the generated library.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum GeneratedFunction {
    RigidBody,
    Gravity,
    Friction,
    Regressor,
}

impl GeneratedFunction {
    /// Functions that return torques, with their descriptions.
    pub(super) const TORQUES: [(Self, &str); 3] = [
        (Self::RigidBody, "Torques of a motion, without friction and offsets."),
        (Self::Gravity, "Torques against gravity at rest, without friction and offsets."),
        (Self::Friction, "Friction and offsets."),
    ];
}

/// States that the self-test visits.
const SELF_TEST_STATES: usize = 4;

impl<'a> Program<'a> {
    pub(super) fn new(model: CodeModel<'a>) -> Result<Self, CodeError> {
        let CodeModel { robot, base, covariance, identified_names: identified, .. } = model;
        if let Some(joint) = robot.known_torques().iter().position(Option::is_some) {
            return Err(CodeError::KnownTorque { joint: JointIndex::new(joint) });
        }
        let of_the_speed =
            |law: &&FrictionLaw| !matches!(law, FrictionLaw::Load | FrictionLaw::Hysteresis { .. });
        for (joint, own) in robot.own_friction().iter().enumerate() {
            if let Some(law) = own.laws.iter().find(|law| !of_the_speed(law)) {
                return Err(CodeError::Friction { joint: JointIndex::new(joint), law: *law });
            }
        }
        let dynamics = Model::new(robot);
        // The same dynamics with as many zero parameters as possible.
        let minimal = base.names().iter().zip(base.to_base(model.standard_parameters));
        let minimal = base.to_standard(minimal).map_err(CodeError::Parameter)?;
        let is_of_a_body = |column: usize| {
            let kind = robot.parameters().parameters()[column].kind;
            kind == ParameterKind::Ia || ParameterKind::LINK.contains(&kind)
        };
        let of_body = |column| if is_of_a_body(column) { minimal[column] } else { 0.0 };
        let functions: Vec<f64> = (0..minimal.len()).map(of_body).collect();
        let columns = identified
            .iter()
            .map(|name| base.find(name).map(|row| base.columns()[row]))
            .collect::<Option<Vec<usize>>>()
            .ok_or(CodeError::Identified)?;
        let wanted = dynamics.regressor_entries(&columns);
        let n = robot.joints();
        let friction = trace_function(|| {
            let parameters: Vec<Traced> = minimal.iter().map(|v| Traced::constant(*v)).collect();
            let mut tau = vec![Traced::zero(); n];
            let [q, dq] = [0, 1].map(|which| input_vector(n, which));
            dynamics.friction(&mut Workspace::new(), &parameters, &q, &dq, &mut tau);
            tau
        });
        let regressor = trace_function(|| {
            let mut out = vec![Traced::zero(); wanted.entries().len()];
            let [q, dq, ddq] = [0, 1, 2].map(|which| input_vector(n, which));
            dynamics.selected_regressor(&mut Workspace::new(), &wanted, &q, &dq, &ddq, &mut out);
            out
        });
        let factor = Cholesky::new(covariance.clone()).ok_or(CodeError::Covariance)?.unpack();
        let factor: Vec<f64> = (0..factor.nrows())
            .flat_map(|row| (0..=row).map(move |column| (row, column)))
            .map(|at| factor[at])
            .collect();
        let checks = (0..SELF_TEST_STATES)
            .map(|k| compute_check(&dynamics, &minimal, &columns, covariance, k));
        Ok(Self {
            prefix: identifier(robot.name()),
            rigid_body: torque_of(&dynamics, &functions, true),
            gravity: torque_of(&dynamics, &functions, false),
            friction,
            regressor,
            entries: wanted.entries().to_vec(),
            factor,
            checks: checks.collect(),
            model,
        })
    }

    pub(super) fn joints(&self) -> usize {
        self.model.robot.joints()
    }

    /// Returns the statements of a function, and its results.
    pub(super) fn statements(
        &self,
        function: GeneratedFunction,
        language: Language,
    ) -> Result<(Vec<String>, Vec<String>), CodeError> {
        let n = self.joints();
        let Function { tape, results } = match function {
            GeneratedFunction::RigidBody => &self.rigid_body,
            GeneratedFunction::Gravity => &self.gravity,
            GeneratedFunction::Friction => &self.friction,
            GeneratedFunction::Regressor => &self.regressor,
        };
        let input = |number: usize| format!("{}[{}]", ["q", "dq", "ddq"][number / n], number % n);
        let prefix = format!("{}_", self.prefix);
        statements(tape, results, language, &prefix, input)
            .ok_or(CodeError::KnownTorque { joint: JointIndex::new(0) })
    }
}

fn trace_function(work: impl FnOnce() -> Vec<Traced>) -> Function {
    let (tape, results) = trace(work);
    Function { tape, results }
}

/// Returns q, q̇ or q̈ of all joints as inputs.
fn input_vector(joints: usize, which: usize) -> Vec<Traced> {
    (0..joints).map(|joint| Traced::input(which * joints + joint)).collect()
}

/// Records the torques of a motion, or of rest.
fn torque_of(dynamics: &Model, parameters: &[f64], moving: bool) -> Function {
    let n = dynamics.joints();
    trace_function(|| {
        let parameters: Vec<Traced> = parameters.iter().map(|v| Traced::constant(*v)).collect();
        let rest = vec![Traced::zero(); n];
        let [q, dq, ddq] = [0, 1, 2]
            .map(|which| if moving || which == 0 { input_vector(n, which) } else { rest.clone() });
        let mut tau = rest;
        dynamics.inverse_dynamics(&mut Workspace::new(), &parameters, &q, &dq, &ddq, &mut tau);
        tau
    })
}

/// Computes the library's results at one state of the self-test.
fn compute_check(
    dynamics: &Model,
    parameters: &[f64],
    columns: &[usize],
    covariance: &DMatrix<f64>,
    number: usize,
) -> SelfTestPoint {
    let n = dynamics.joints();
    // The states are spread evenly by the golden ratio.
    let state = [3.0, 2.0, 10.0].map(|size| {
        let value = |joint: usize| (number * n + joint + 1) as f64 * 0.618_033_988_749_895 * size;
        (0..n).map(|joint| (value(joint) % 1.0 - 0.5) * 2.0 * size).collect::<Vec<f64>>()
    });
    let [q, dq, ddq] = &state;
    let (mut ws, mut torque) = (Workspace::new(), vec![0.0; n]);
    dynamics.inverse_dynamics(&mut ws, parameters, q, dq, ddq, &mut torque);
    let mut regressor = vec![0.0; n * columns.len()];
    let wanted = dynamics.regressor_columns(columns);
    dynamics.selected_regressor(&mut ws, &wanted, q, dq, ddq, &mut regressor);
    let y = DMatrix::from_row_slice(n, columns.len(), &regressor);
    let variance = (&y * covariance * y.transpose()).diagonal().as_slice().to_vec();
    SelfTestPoint { state, torque, variance }
}

/// Converts a name to an identifier of both languages.
pub(super) fn identifier(name: &str) -> String {
    let plain = |of: char| if of.is_ascii_alphanumeric() { of.to_ascii_lowercase() } else { '_' };
    let text: String = name.chars().map(plain).collect();
    if text.starts_with(|of: char| of.is_ascii_digit()) { format!("arm_{text}") } else { text }
}
